"""A live bus for Foxglove: the same topics and numbers as `ema export --signals`, over a WebSocket.

Phase currents and positions are thinned for the screen; all of them are in the log.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ema.alarms.causes import OF_MONITOR
from ema.bus.codec import Codec
from ema.bus.codec import Message as DbcMessage
from ema.bus.identifiers import actuator
from ema.bus.protection import GOOD, Receiver
from ema.core.closing import Closing
from ema.core.errors import BusError
from ema.core.status import AlarmLevel, AlarmState, LogState, ServiceState, Status
from ema.log import Message
from ema.log.schemas import to_json

from .live import ESTIMATES
from .numeric import SamplesOfFrames, Series, of_message
from .numeric_files import TOPIC, schema_of

MOST = 1000  # samples of a channel in a second that are shown
_MIB = 1 << 20
_OF_MONITOR = {cause.name for cause in OF_MONITOR}


class FoxgloveServer(Closing):
    """Sends what frames say to every Foxglove that is connected.

    Parameters
    ----------
    codec : Codec
    host : str
    port : int
        0 chooses a free one.

    Raises
    ------
    BusError
        The port cannot be had.
    """

    def __init__(self, codec: Codec, host: str, port: int):
        import foxglove

        self._codec = codec
        self._samples = SamplesOfFrames(codec)
        self._receiver = Receiver(codec, [*ESTIMATES, "Alarm", "Heartbeat"])
        self._channels: dict[str, Any] = {}
        self._next_ns: dict[str, int] = {}
        self._foxglove, self._context = foxglove, foxglove.Context()
        try:
            self._server = foxglove.start_server(name="ema", host=host, port=port, context=self._context)
        except (RuntimeError, OSError, ValueError) as error:
            raise BusError(f"Foxglove cannot be served on {host}:{port} ({error})") from error
        self.url = f"ws://{host}:{self._server.port}"

    def update(self, bus: str, frames: np.ndarray) -> None:
        """Take frames as received, shape (n,), FRAME_DTYPE."""
        for series in self._samples.take(bus, frames):
            self._send(self._thinned(series))
        good = frames[self._receiver.check(frames) <= GOOD]
        for message, own in self._codec.split(good):
            for said in _messages(message, own):
                for series in of_message(said, self._samples):
                    self._send(series)

    def close(self) -> None:
        """End the server."""
        self._server.stop()

    def _thinned(self, series: Series) -> Series:
        """At most MOST samples in a second."""
        t_ns, step = series.t_ns, 1_000_000_000 // MOST
        kept, after = [], self._next_ns.get(series.channel, 0)
        for index, t in enumerate(t_ns.tolist()):
            if t >= after or t < after - 10 * step:  # or a clock that was set back
                kept.append(index)
                after = t + step
        self._next_ns[series.channel] = after
        return series._replace(t_ns=t_ns[kept], values={name: x[kept] for name, x in series.values.items()})

    def _send(self, series: Series) -> None:
        channel = self._channels.get(series.channel)
        if channel is None:
            kind = self._foxglove.Schema(
                name=f"ema.signals.{series.channel}", encoding="jsonschema", data=schema_of(series)
            )
            topic = TOPIC + series.channel
            channel = self._foxglove.Channel(topic, schema=kind, message_encoding="json", context=self._context)
            self._channels[series.channel] = channel
        columns = [x.tolist() for x in series.values.values()]
        for t_ns, *row in zip(series.t_ns.tolist(), *columns, strict=True):
            channel.log(to_json(dict(zip(series.values, row, strict=True))), log_time=max(0, t_ns))


def _messages(message: DbcMessage, own: np.ndarray) -> Iterator[Message]:
    """What the log would say of these frames."""
    values = message.decode(own)
    for row, (number, t_ns) in enumerate(zip(actuator(own["id"]).tolist(), own["t_ns"].tolist(), strict=True)):
        one = {name: column[row] for name, column in values.items()}
        if message.name in ESTIMATES:
            yield Message("/estimate", t_ns, _estimate(number, ESTIMATES[message.name], one))
        elif message.name == "Heartbeat":
            yield Message("/status", t_ns, _status(one))
        elif message.name == "Alarm" and int(one["cause"]):
            yield Message("/alarm", t_ns, _alarm(number, one, message.fields["cause"].names))


def _estimate(number: int, method: str, one: dict[str, Any]) -> dict[str, Any]:
    numbers = {name: float(one[name]) for name in ("p_value", "residual", "age") if name in one}
    status = Status(int(one["status"])).name.lower()
    return {
        "actuator": number,
        "method": method,
        "k": list(one["k"]),
        "sd": list(one["sd_k"]),
        "status": status,
    } | numbers


def _status(one: dict[str, Any]) -> dict[str, Any]:
    return {
        "state": ServiceState(int(one["state"])).name.lower(),
        "log_state": LogState(int(one["log_state"])).name.lower(),
        "uptime": int(one["uptime"]),
        "log_free": int(one["log_free"]) * _MIB,
        "lapses": [int(one["reason"])] if one.get("reason", 0) else [],
        "counters": {name: int(value) for name, value in one.items() if name.startswith(("n_", "kernel_"))},
    }


def _alarm(number: int, one: dict[str, Any], causes: Mapping[int, str]) -> dict[str, Any]:
    cause = causes.get(int(one["cause"]), str(int(one["cause"])))
    numbers = {name: float(one[name]) for name in ("value", "low", "high", "limit")}
    return {
        "actuator": None if cause in _OF_MONITOR else number,
        "cause": cause,
        "level": AlarmLevel(int(one["level"])).name.lower(),
        "state": AlarmState(int(one["state"])).name.lower(),
    } | numbers
