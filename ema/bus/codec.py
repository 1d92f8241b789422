"""Frames to physical values and back, in batches; every layout comes from the DBC when the program starts.

Signals are byte-aligned, so that a numpy view on the raw frames decodes a whole batch at once. Signals that
differ by a final number only (`i_a_0` … `i_a_9`, `k1` … `k6`) form one array under the common name (`i_a`, `k`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from ema.core import frames as fr
from ema.core import resources
from ema.core.errors import BusError

from . import identifiers
from .header import HEADER_SIGNALS

_FLAGS = int(fr.FrameFlag.EXTENDED | fr.FrameFlag.FD)
_REFUSED = int(fr.FrameFlag.REFUSED)
_DATA_OFFSET = fr.FRAME_DTYPE.fields["data"][1]  # type: ignore[index]


class Field(NamedTuple):
    """Where a signal, or a series of `n_values` signals `step` bytes apart, lies in the payload."""

    name: str
    dtype: np.dtype[Any]
    byte: int
    step: int
    n_values: int  # 0: a single signal
    scale: float
    offset: float
    raw_min: float
    raw_max: float
    unit: str
    names: Mapping[int, str] = MappingProxyType({})  # of values that stand for something

    @property
    def is_count(self) -> bool:
        """Whether the values are the raw integers themselves."""
        return self.scale == 1 and self.offset == 0 and self.dtype.kind in "iu"

    def view(self, frames: np.ndarray) -> np.ndarray:
        """Raw values inside the batch (no copy), shape (n,) or (n, n_values)."""
        shape = (frames.size, self.n_values) if self.n_values else (frames.size,)
        if not frames.size:
            return np.empty(shape, self.dtype)
        strides = (fr.FRAME_DTYPE.itemsize, self.step)[: len(shape)]
        return np.ndarray(shape, self.dtype, frames.view(np.uint8).data, _DATA_OFFSET + self.byte, strides)


class Message(NamedTuple):
    """One message of the DBC."""

    name: str
    frame_id: int  # of actuator 0
    length: int
    sender: str
    period: float  # nominal time between frames, 0: not periodic [s]
    timeout: float  # a frame is missed after this time, 0: never [s]
    fields: dict[str, Field]

    def decode(self, frames: np.ndarray) -> dict[str, np.ndarray]:
        """Physical values of a batch of frames of this message, by signal.

        Parameters
        ----------
        frames : array, shape (n,), dtype FRAME_DTYPE
            Frames of this message, of any actuators, of the right length.

        Returns
        -------
        values : dict of arrays, shape (n,) or (n, n_values)
            Counts as integers, quantities as floats in the unit the DBC gives.
        """
        frames = np.ascontiguousarray(frames)
        return {f.name: _physical(f, f.view(frames)) for f in self.fields.values()}


class Codec:
    """All messages of a DBC.

    Parameters
    ----------
    path : path
        DBC file; BusError when it cannot be read or holds what this codec cannot decode.
    """

    def __init__(self, path: str | Path | None = None):
        import cantools

        self.path = Path(path) if path is not None else resources.dbc()
        try:
            database: Any = cantools.database.load_file(self.path, database_format="dbc")
        except OSError as error:
            raise BusError(f"{self.path}: cannot be read ({error.strerror})") from error
        except Exception as error:  # the parser's own tree of errors, and what it lets through
            raise BusError(f"{self.path}: is not a valid DBC ({error})") from error
        self.messages = {m.name: _message(m, self.path) for m in database.messages}
        self._by_id = {m.frame_id: m for m in self.messages.values()}

    def find(self, frame_id: int) -> Message | None:
        """Message of an identifier, of any actuator; None when it is foreign."""
        return self._by_id.get(identifiers.message_id(frame_id))

    def number(self, message: str, signal: str, name: str) -> int:
        """What stands for `name` in the DBC's table of a signal's values."""
        for number, known in self.messages[message].fields[signal].names.items():
            if known == name:
                return number
        raise BusError(f"{self.path}: signal {message}.{signal} has no value '{name}'")

    def filters(self, sender: str) -> list[tuple[int, int]]:
        """Filters for `open_bus` that let through what this node of the DBC sends, for any actuator."""
        return [(m.frame_id, identifiers.MESSAGE_MASK) for m in self.messages.values() if m.sender == sender]

    def filters_of(self, *names: str) -> list[tuple[int, int]]:
        """The same for single messages by their names."""
        return [(self.messages[name].frame_id, identifiers.MESSAGE_MASK) for name in names]

    def split(self, frames: np.ndarray) -> Iterator[tuple[Message, np.ndarray]]:
        """The messages in a batch, each with its frames in order; foreign and refused frames are left out."""
        ids = identifiers.message_id(frames["id"])
        accepted = (frames["flags"] & _REFUSED) == 0
        for frame_id in sorted(set(ids[accepted].tolist())):
            if frame_id in self._by_id:
                yield self._by_id[frame_id], frames[(ids == frame_id) & accepted]

    def encode(self, name: str, actuator: int, values: Mapping[str, Any], t_ns: Any = 0) -> np.ndarray:
        """Frames of one message; the header stays zero until `protection.Sender` fills it.

        Parameters
        ----------
        name : str
            Message of the DBC.
        actuator : int
            0…63.
        values : mapping of signal to number or array, shape (), (n,) or (n, n_values)
            Physical values; what lies outside the range is clipped to it, as a converter does. Every signal must
            be given.

        Returns
        -------
        frames : array, shape (n,), dtype FRAME_DTYPE

        Raises
        ------
        BusError
            A signal is missing, unknown, of the wrong shape, or not finite.
        """
        message = self.messages.get(name)
        if message is None:
            raise BusError(f"{self.path}: no message '{name}'")
        if message.fields.keys() != values.keys():
            odd = sorted(message.fields.keys() ^ values.keys())
            raise BusError(f"message '{name}': signals missing or unknown: {', '.join(odd)}")
        arrays = {key: np.asarray(value) for key, value in values.items()}
        leading = (a.shape[: -1 if message.fields[key].n_values else None] for key, a in arrays.items())
        try:
            shape = np.broadcast_shapes((1,), *leading)
            out = fr.empty(shape[0])
            out["t_ns"] = t_ns
            out["id"] = identifiers.with_actuator(message.frame_id, actuator)
            out["flags"] = _FLAGS
            out["length"] = message.length
            for key, array in arrays.items():
                field = message.fields[key]
                field.view(out)[...] = _raw(field, array)
        except ValueError as error:
            raise BusError(f"message '{name}': {error}") from error
        return out


@cache
def default() -> Codec:
    """Codec of the project's own DBC."""
    return Codec()


def _physical(field: Field, raw: np.ndarray) -> np.ndarray:
    if field.is_count:
        return raw.astype(field.dtype.newbyteorder("="))
    return raw * field.scale + field.offset


def _raw(field: Field, value: np.ndarray) -> np.ndarray:
    if field.is_count and value.dtype.kind in "iub":
        return np.clip(value, int(field.raw_min), int(field.raw_max))
    if not np.isfinite(value).all():
        raise ValueError(f"signal '{field.name}' is not finite")
    raw = (value - field.offset) / field.scale
    return raw if field.dtype.kind == "f" else np.clip(np.rint(raw), field.raw_min, field.raw_max)


def _message(m: Any, path: Path) -> Message:
    singles = [_field(s, m, path) for s in m.signals if s.name not in HEADER_SIGNALS]
    series: dict[str, list[tuple[int, Field]]] = {}
    for field in singles:
        stem, number = re.fullmatch(r"(.*?)_?(\d*)", field.name).groups()  # type: ignore[union-attr]
        series.setdefault(stem if number else field.name, []).append((int(number or 0), field))
    fields: dict[str, Field] = {}
    for name, members in series.items():
        whole = _series(name, [field for _, field in sorted(members)])
        fields.update({name: whole} if whole else {field.name: field for _, field in members})
    attributes = m.dbc.attributes
    timeout = attributes["TimeoutMs"].value if "TimeoutMs" in attributes else 0
    sender = m.senders[0] if m.senders else ""
    return Message(m.name, m.frame_id, m.length, sender, (m.cycle_time or 0) / 1e3, timeout / 1e3, fields)


def _field(s: Any, m: Any, path: Path) -> Field:
    bit = s.start if s.byte_order == "little_endian" else s.start - 7
    if bit % 8 or s.length not in (8, 16, 32, 64) or s.is_multiplexer or s.multiplexer_ids:
        raise BusError(f"{path}: signal {m.name}.{s.name} is not a byte-aligned number of 1, 2, 4 or 8 bytes")
    kind = "f" if s.is_float else "i" if s.is_signed else "u"
    dtype = np.dtype(f"{'<' if s.byte_order == 'little_endian' else '>'}{kind}{s.length // 8}")
    scale, offset = float(s.scale), float(s.offset)
    limits = np.finfo(dtype) if kind == "f" else np.iinfo(dtype)
    low = limits.min if s.minimum is None else max(limits.min, round((s.minimum - offset) / scale))
    high = limits.max if s.maximum is None else min(limits.max, round((s.maximum - offset) / scale))
    names = {int(number): str(name) for number, name in (s.choices or {}).items()}
    return Field(s.name, dtype, bit // 8, 0, 0, scale, offset, low, high, s.unit or "", MappingProxyType(names))


def _series(name: str, members: list[Field]) -> Field | None:
    """One field for signals that differ only by an even distance, or None."""
    if len(members) < 2:
        return None
    first, step = members[0], members[1].byte - members[0].byte
    for n, field in enumerate(members):
        if field._replace(name="", byte=0) != first._replace(name="", byte=0) or field.byte != first.byte + n * step:
            return None
    return first._replace(name=name, step=step, n_values=len(members))
