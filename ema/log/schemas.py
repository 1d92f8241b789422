"""Every channel of a log: topic, JSON schema, meaning. The one place; writer, reader, tests and docs derive from it.

All messages are JSON (`json` encoding with `jsonschema`), so that Foxglove and PlotJuggler open a log without plug-ins.
Times are integers, nanoseconds since the Unix epoch. A number that does not exist is null, never NaN.
"""

from __future__ import annotations

import json
from typing import Any, NamedTuple

from ema.core.names import FAULTS
from ema.core.status import AlarmLevel, AlarmState, Lapse, LogState, Reason, ServiceState, Status

METHODS = ("linear", "lf2", "hf")  # identifiers that the daemon runs
ACTUATORS = 64

Schema = dict[str, Any]


def _integer(meaning: str, **bounds: int) -> Schema:
    return {"type": "integer", "description": meaning, **bounds}


def _number(meaning: str, **bounds: float) -> Schema:
    return {"type": "number", "description": meaning, **bounds}


def _choice(meaning: str, names: list[str]) -> Schema:
    return {"type": "string", "description": meaning, "enum": names}


def _list(meaning: str, item: Schema, count: int | None = None) -> Schema:
    length = {} if count is None else {"minItems": count, "maxItems": count}
    return {"type": "array", "description": meaning, "items": item, **length}


def _or_null(schema: Schema) -> Schema:
    kind = schema["type"]
    return {**schema, "type": [kind, "null"]}


_T_NS = _integer("time, ns since the Unix epoch", minimum=0)
_ACTUATOR = _integer("actuator number", minimum=0, maximum=ACTUATORS - 1)
_CYCLE = _integer("cycle id, increasing per actuator", minimum=0, maximum=2**32 - 1)
_VALUE = {"type": ["number", "null"]}
_ORDER = f"in the order {', '.join(FAULTS)}"


class Kind(NamedTuple):
    """One kind of message: its schema's name, its topic (a template over the message's own keys) and its fields."""

    name: str
    topic: str
    meaning: str
    fields: dict[str, Schema]

    @property
    def schema(self) -> Schema:
        """The JSON schema; every field is required, no other is allowed."""
        return {
            "$schema": "https://json-schema.org/draft/2020-12/schema",
            "title": self.name,
            "description": self.meaning,
            "type": "object",
            "properties": self.fields,
            "required": list(self.fields),
            "additionalProperties": False,
        }

    @property
    def schema_text(self) -> bytes:
        """The JSON schema as stored in a log."""
        return json.dumps(self.schema, ensure_ascii=False).encode()

    def encode(self, content: dict[str, Any], t_ns: int | None = None) -> Encoded:
        """A message ready to be stored, at `t_ns` (default: the content's own)."""
        topic = self.topic.format_map(content)
        return Encoded(self, topic, int(content["t_ns"]) if t_ns is None else t_ns, to_json(content))


class Encoded(NamedTuple):
    """A message as it is stored."""

    kind: Kind
    topic: str
    t_ns: int
    data: bytes


FRAMES = Kind(
    "ema.Frames",
    "/can/frames",
    "A batch of raw CAN frames (at most 512 frames or 0.25 s).",
    {
        "bus": {"type": "string", "description": "interface the frames were received on"},
        "count": _integer("number of frames", minimum=1),
        "first_ns": _integer("time of the first frame, ns since the Unix epoch", minimum=0),
        "frames": {
            "type": "string",
            "contentEncoding": "base64",
            "description": "packed records, little-endian: t_ns u64, id u32, flags u8 (1 extended, 2 remote, 4 error, "
            "8 FD, 16 BRS, 32 ESI, 64 sent by this process), length u8, data 64 bytes",
        },
    },
)

ESTIMATE = Kind(
    "ema.Estimate",
    "/estimate/{actuator}/{method}",
    "Faults of one actuator from one cycle, by one method.",
    {
        "t_ns": _T_NS,
        "actuator": _ACTUATOR,
        "method": _choice("identifier", list(METHODS)),
        "cycle": _CYCLE,
        "status": _choice("how far the estimate can be trusted", [s.name.lower() for s in Status]),
        "reasons": _list("why, or what else to know", {"type": "string", "enum": Reason(sum(Reason)).names}),
        "k": _list(f"fault estimates, 0 healthy … 1 complete failure, {_ORDER}", _VALUE, len(FAULTS)),
        "sd": _list(f"standard deviations of k, {_ORDER}", _VALUE, len(FAULTS)),
        "p_value": _or_null(_number("probability of a larger residual if the model holds", minimum=0, maximum=1)),
        "residual": _or_null(_number("root mean square of measured less modelled envelope [A]", minimum=0)),
        "age": _or_null(
            _number("from the cycle's last sample to the sending [s], null where nothing was sent", minimum=0)
        ),
    },
)

NUISANCE = Kind(
    "ema.Nuisance",
    "/nuisance/{actuator}/{method}",
    "A parameter of the model estimated beside the faults of one cycle; it is no fault.",
    {
        "t_ns": _T_NS,
        "actuator": _ACTUATOR,
        "method": _choice("identifier", list(METHODS)),
        "cycle": _CYCLE,
        "status": _choice("how far the estimate can be trusted", [s.name.lower() for s in Status]),
        "parameter": {"type": "string", "description": "effect.parameter"},
        "unit": {"type": "string", "description": "of value, sd and limits; 1 without dimension"},
        "value": _number("estimate"),
        "sd": _number("standard deviation", minimum=0),
        "low": _number("lower limit of the interval of 95 %"),
        "high": _number("upper limit of the interval of 95 %"),
    },
)

ENVELOPE = Kind(
    "ema.Envelope",
    "/envelope/{actuator}",
    "Envelope of the phase currents at the sampling schedule of one cycle, beside the model at the estimated faults.",
    {
        "t_ns": _T_NS,
        "actuator": _ACTUATOR,
        "cycle": _CYCLE,
        "t": _list("time since the start of the cycle [s]", {"type": "number"}),
        "measured": _list("measured envelope [A], null in a gap", _VALUE),
        "model": _list("model at the linear estimate [A], null without one", _VALUE),
        "sd": _list("standard deviation of the measured envelope [A]", _VALUE),
    },
)

EVENT = Kind(
    "ema.Event",
    "/event",
    "Something happened that a person may want to know.",
    {
        "t_ns": _T_NS,
        "level": _choice("severity", ["info", "warning", "error"]),
        "code": {"type": "string", "description": "short name of the kind of event"},
        "text": {"type": "string", "description": "one line for a person"},
        "actuator": _or_null(_ACTUATOR),
    },
)

ALARM = Kind(
    "ema.Alarm",
    "/alarm",
    "An alarm as it is after a change; the words are those of ISA-18.2.",
    {
        "t_ns": _T_NS,
        "actuator": _or_null(
            _integer("actuator number, null for the monitor itself", minimum=0, maximum=ACTUATORS - 1)
        ),
        "cause": {"type": "string", "description": "what it is about: k1 … k6, k1_rate …, k1_life …, model_in_doubt …"},
        "level": _choice("how urgent", [level.name.lower() for level in AlarmLevel]),
        "state": _choice("state of the alarm", [state.name.lower() for state in AlarmState]),
        "since_cycle": _CYCLE,
        "since_ns": _integer("when the condition of this level came, ns since the Unix epoch", minimum=0),
        "value": _or_null(_number("what is judged: k [1], its rate [1/h], or the time to its alarm level [h]")),
        "low": _or_null(_number("lower end of its interval; of remaining life the earlier")),
        "high": _or_null(_number("upper end of its interval; null: there is none")),
        "limit": _or_null(_number("setpoint of the level")),
        "shelved_until_ns": _integer("end of shelving, ns since the Unix epoch; 0: not shelved", minimum=0),
        "text": {"type": "string", "description": "one line for a person"},
    },
)

ALARM_STATE = Kind(
    "ema.AlarmState",
    "/alarm/state",
    "Everything the alarms go on from, when the monitor starts or takes over other thresholds; a replay follows.",
    {
        "t_ns": _T_NS,
        "settings": {"type": "object", "description": "the thresholds from here on (config/alarms.yaml)"},
        "snapshot": {"type": "object", "description": "as in the state file (docs/alarms.md)"},
    },
)

STATUS = Kind(
    "ema.Status",
    "/status",
    "Copy of the daemon's heartbeat, with the counts in full.",
    {
        "t_ns": _T_NS,
        "state": _choice("state of the service", [s.name.lower() for s in ServiceState]),
        "uptime": _number("time since the start [s]", minimum=0),
        "log_state": _choice("state of the log", [s.name.lower() for s in LogState]),
        "log_free": _number("free space of the log's file system [B]", minimum=0),
        "lapses": _list(
            "what the configuration promises and does not happen, the gravest first",
            {
                "type": "object",
                "properties": {
                    "reason": _choice("what", [lapse.name.lower() for lapse in Lapse if lapse]),
                    "actuator": _or_null(_ACTUATOR),
                    "subject": {"type": "string", "description": "identifier, where it is of one"},
                },
                "required": ["reason", "actuator", "subject"],
                "additionalProperties": False,
            },
        ),
        "counters": {
            "type": "object",
            "description": "counts since the start: frames and cycles seen, estimated, lost, repeated, corrupt …",
            "additionalProperties": {"type": "integer", "minimum": 0},
        },
    },
)


def to_json(content: dict[str, Any]) -> bytes:
    """JSON of a message; numpy values become lists and numbers, NaN becomes null, floats keep every bit."""
    return json.dumps(_plain(content), allow_nan=False, separators=(",", ":"), ensure_ascii=False).encode()


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and (value != value or value in (float("inf"), float("-inf"))):
        return None
    return value
