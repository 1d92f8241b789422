"""A log as plain numeric series, sample by sample, for tools that plot: names, units, times; nothing packed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from statistics import NormalDist
from typing import Any, NamedTuple

import numpy as np

from ema.bus.codec import Codec
from ema.bus.codec import Message as DbcMessage
from ema.bus.header import N_SEQUENCES, sequence
from ema.bus.identifiers import actuator, message_id
from ema.bus.protection import GOOD, Receiver
from ema.bus.span import MOTION_RATIO, Span
from ema.core.errors import LogError
from ema.core.names import FAULTS
from ema.core.status import AlarmLevel, AlarmState, LogState, ServiceState, Status
from ema.log import LogReader, Message

_LEVEL = 0.95  # of the intervals
_Z = NormalDist().inv_cdf(0.5 + _LEVEL / 2)
_PERIOD = 1e-4  # of the currents, until a CycleStart says it [s]
_JITTER_NS = 10_000_000  # frames of one channel overlap by less; a larger step back is a clock that was set
# Messages of samples in a row, and how many times the currents' period lies between two.
_SAMPLED = {"PhaseCurrents": ("currents", 1), "Motion": ("motion", MOTION_RATIO), "Supply": ("supply", 0)}


class Series(NamedTuple):
    """Samples of one channel: `t_ns` shape (n,), `values` by name, each of shape (n,), `units` by name."""

    channel: str
    t_ns: np.ndarray
    values: dict[str, np.ndarray]
    units: Mapping[str, str]


def numeric_series(log: LogReader, codec: Codec) -> Iterator[Series]:
    """Everything in a log that is a number, in parts, in the order of the log.

    Phase currents, positions and supply of each actuator from the frames that pass the protection; envelope, estimates
    with their interval of 95 % (k ± 1.96 sd within 0 … 1), parameters beside the faults, alarms and states as numbers
    (`ema.core.status`).
    """
    from_frames = SamplesOfFrames(codec)
    last_ns: dict[str, int] = {}
    for entry in log.entries():
        try:
            found = list(of_message(entry, from_frames) if isinstance(entry, Message) else from_frames.take(*entry))
        except (KeyError, TypeError, ValueError) as error:
            topic = entry.topic if isinstance(entry, Message) else "/can/frames"
            raise LogError(f"a message on {topic} is not what this version writes ({error!r})") from error
        for series in found:
            yield _onward(series, last_ns)


def _onward(series: Series, last_ns: dict[str, int]) -> Series:
    """Times that do not run back by the jitter of their reception."""
    t_ns = series.t_ns.astype(np.int64)
    before = last_ns.get(series.channel)
    if before is not None and 0 < before - int(t_ns[0]) < _JITTER_NS:
        t_ns = np.maximum(t_ns, before)
    t_ns = np.where(np.abs(np.maximum.accumulate(t_ns) - t_ns) < _JITTER_NS, np.maximum.accumulate(t_ns), t_ns)
    last_ns[series.channel] = int(t_ns[-1])
    return series._replace(t_ns=t_ns)


class SamplesOfFrames:
    """Samples of frames, at the times at which they were taken."""

    def __init__(self, codec: Codec):
        self._codec = codec
        self._receivers: dict[str, Receiver] = {}
        self._spans: dict[int, Span] = {}  # of the latest cycle of each actuator
        self.started_ns: dict[tuple[int, int], int] = {}  # by actuator and cycle; the last two of each

    def take(self, bus: str, frames: np.ndarray) -> Iterator[Series]:
        """Series of the frames that pass the protection."""
        receiver = self._receivers.setdefault(bus, Receiver(self._codec))
        good = frames[receiver.check(frames) <= GOOD]
        starts = self._codec.messages["CycleStart"].frame_id
        cuts = np.flatnonzero(message_id(good["id"]) == starts)
        for part in np.split(good, cuts):  # what a CycleStart says holds for the frames behind it
            for message, own in self._codec.split(part):
                if message.name == "CycleStart":
                    self._start(message.decode(own), own)
            for message, own in self._codec.split(part):
                if message.name in _SAMPLED:
                    numbers = actuator(own["id"])
                    for number in sorted(set(numbers.tolist())):
                        yield from self._samples(message, number, own[numbers == number])

    def _samples(self, message: DbcMessage, number: int, own: np.ndarray) -> Iterator[Series]:
        kind, ratio = _SAMPLED[message.name]
        decoded = message.decode(own)
        values = {name: np.asarray(samples, float).reshape(len(own), -1) for name, samples in decoded.items()}
        n = next(iter(values.values())).shape[1]
        span = self._spans.get(number)
        place = np.arange(n)
        last = np.full((len(own), 1), n - 1)  # of the samples in a frame; the frame goes with it
        if span is not None and ratio:
            first = span.first_current if ratio == 1 else span.first_motion
            total = span.n_samples if ratio == 1 else span.n_motion_samples
            left = total - n * ((sequence(own).astype(int) - first) % N_SEQUENCES)[:, None]
            last = np.where(left > 0, np.minimum(left, n), n) - 1  # what fills up a cycle's last frame is no sample
        step_ns = ratio * (span.period if span else _PERIOD) * 1e9
        t_ns = own["t_ns"].astype(np.int64)[:, None] - np.rint(step_ns * (last - place)).astype(np.int64)
        real = place <= last
        units = {name: message.fields[name].unit or "1" for name in values}
        yield Series(f"{kind}/{number}", t_ns[real], {name: v[real] for name, v in values.items()}, units)

    def _start(self, values: dict[str, np.ndarray], own: np.ndarray) -> None:
        for row, number in enumerate(actuator(own["id"]).tolist()):
            said = {name: values[name][row] for name in Span._fields}
            period = float(said.pop("period"))
            self._spans[number] = Span(**{name: int(value) for name, value in said.items()}, period=period)
            for key in [key for key in self.started_ns if key[0] == number][:-1]:
                del self.started_ns[key]
            self.started_ns[number, self._spans[number].cycle] = int(own["t_ns"][row])


def of_message(message: Message, frames: SamplesOfFrames) -> Iterator[Series]:
    """What of one message of the log, or one made from a frame on a live bus, is a number."""
    said = message.content
    kind = message.topic.split("/")[1]
    if kind == "estimate":
        k, sd = _numbers(said["k"]), _numbers(said["sd"])
        one: dict[str, Any] = dict(zip(FAULTS, k, strict=True))
        one |= {f"low_{f}": max(0.0, a - _Z * s) for f, a, s in zip(FAULTS, k, sd, strict=True)}
        one |= {f"high_{f}": min(1.0, a + _Z * s) for f, a, s in zip(FAULTS, k, sd, strict=True)}
        one |= {"p_value": said["p_value"], "residual": said["residual"], "status": Status[said["status"].upper()]}
        one["age"] = said.get("age")
        yield _point(f"estimate/{said['actuator']}/{said['method']}", message.t_ns, one, residual="A", age="s")
    elif kind == "nuisance":
        one = {name: said[name] for name in ("value", "low", "high")}
        channel = f"nuisance/{said['actuator']}/{said['method']}/{said['parameter']}"
        yield _point(channel, message.t_ns, one, **dict.fromkeys(one, said["unit"]))
    elif kind == "envelope":
        t = np.array(said["t"], float)
        ends_ns = message.t_ns - round(t[-1] * 1e9) if len(t) else message.t_ns
        start_ns = frames.started_ns.get((said["actuator"], said["cycle"]), ends_ns)
        values = {name: np.array(_numbers(said[name])) for name in ("measured", "model", "sd")}
        if len(t):
            t_ns = start_ns + np.rint(t * 1e9).astype(np.int64)
            yield Series(f"envelope/{said['actuator']}", t_ns, values, dict.fromkeys(values, "A"))
    elif kind == "alarm" and "level" in said:
        who = "monitor" if said["actuator"] is None else said["actuator"]
        one = {"level": AlarmLevel[said["level"].upper()], "state": AlarmState[said["state"].upper()]}
        one |= {name: said[name] for name in ("value", "low", "high", "limit")}
        yield _point(f"alarm/{who}/{said['cause']}", message.t_ns, one)
    elif kind == "status":
        one = {"state": ServiceState[said["state"].upper()], "log_state": LogState[said["log_state"].upper()]}
        one |= {"uptime": said["uptime"], "log_free": said["log_free"], "n_lapses": len(said.get("lapses", []))}
        counters = {name: said["counters"][name] for name in sorted(said["counters"])}
        yield _point("status", message.t_ns, one | counters, uptime="s", log_free="B")


def _point(channel: str, t_ns: int, one: Mapping[str, Any], **units: str) -> Series:
    values = {name: np.array(_numbers([value])) for name, value in one.items()}
    return Series(channel, np.array([t_ns], np.int64), values, dict.fromkeys(one, "1") | units)


def _numbers(values: list[Any]) -> list[float]:
    return [float("nan") if value is None else float(value) for value in values]
