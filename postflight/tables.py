"""A log as tables: rows in blocks, columns with units."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ema.bus.codec import Codec, Message
from ema.bus.identifiers import actuator, message_id
from ema.bus.protection import Check, Receiver
from ema.core.errors import LogError
from ema.core.names import CHANNELS, FAULTS
from ema.log import LogReader
from ema.log.reader import FrameBatch
from ema.monitor.recorded import cycles

_BLOCK = 2000  # rows


class Column(NamedTuple):
    """One column: its unit is empty for text, 1 for a number without dimension."""

    name: str
    unit: str

    def __str__(self) -> str:
        return f"{self.name} [{self.unit}]" if self.unit else self.name


class Block(NamedTuple):
    """Rows of one table; the columns of a table are the same in all its blocks."""

    table: str
    columns: list[Column]
    values: list[list[Any]]  # one list for each column


_T_NS = Column("t_ns", "ns")
_WHO = [_T_NS, Column("actuator", ""), Column("cycle", "")]
_ESTIMATES = [
    *_WHO, Column("method", ""), Column("status", ""), Column("reasons", ""), Column("p_value", "1"),
    Column("residual", "A"), *(Column(k, "1") for k in FAULTS), *(Column(f"sd_{k}", "1") for k in FAULTS),
]  # fmt: skip
_ENVELOPES = [*_WHO, Column("t", "s"), Column("measured", "A"), Column("model", "A"), Column("sd", "A")]
_EVENTS = [_T_NS, Column("level", ""), Column("code", ""), Column("actuator", ""), Column("text", "")]
_STATUS = [_T_NS, Column("state", ""), Column("uptime", "s"), Column("log_state", ""), Column("log_free", "B")]
MESSAGE_TABLES = ("estimates", "envelopes", "events", "status")


def message_blocks(log: LogReader, wanted: set[str]) -> Iterator[Block]:
    """Estimates, envelopes (one row for each scheduled instant), events and status.

    The counters of the status are those of its first message; further ones of later messages are left out.
    """
    prefixes = {"estimates": "/estimate/", "envelopes": "/envelope/", "events": "/event", "status": "/status"}
    chosen = tuple(prefixes[name] for name in MESSAGE_TABLES if name in wanted)
    waiting: dict[str, tuple[list[Column], list[list[Any]]]] = {}
    for topic, _, content in log.messages(lambda topic: topic.startswith(chosen)):
        table = next(name for name, prefix in prefixes.items() if topic.startswith(prefix))
        if table not in waiting:
            waiting[table] = (_columns(table, content), [])
        columns, rows = waiting[table]
        try:
            rows += _rows(table, columns, content)
        except (KeyError, TypeError, ValueError) as error:
            raise LogError(f"a message on {topic} is not what this version writes ({error!r})") from error
        if len(rows) >= _BLOCK:
            yield _block(table, columns, rows)
            waiting[table] = (columns, [])
    for table, (columns, rows) in waiting.items():
        if rows:
            yield _block(table, columns, rows)


def signal_blocks(codec: Codec, batches: Iterator[FrameBatch]) -> Iterator[Block]:
    """Signals of every frame that the DBC knows, one table for each message.

    The column `check` says what the protection found (ok, crc_error …). A message of series of equal length
    (ten samples of each current) becomes one row for each sample.
    """
    receivers: dict[str, Receiver] = {}
    for bus, frames in batches:
        checks = receivers.setdefault(bus, Receiver(codec)).check(frames)
        ids = message_id(frames["id"])
        for message in codec.messages.values():
            mine = (ids == message.frame_id) & (frames["length"] == message.length)
            if mine.any():
                yield _signals(message, bus, frames[mine], checks[mine])


def cycle_blocks(log: LogReader) -> Iterator[Block]:
    """Recorded cycles without gaps, one table for each actuator, as records."""
    for number, cycle in cycles(log):
        columns = [Column("cycle", ""), *(Column(name, CHANNELS[name].unit) for name in cycle.channels)]
        values = [[cycle.number] * cycle.n_samples, *(channel.tolist() for channel in cycle.channels.values())]
        yield Block(f"cycles-{number}", columns, values)


def codec_of(log: LogReader) -> Codec:
    """Codec by the DBC that the log carries, else by the one shipped."""
    dbc = log.attachments().get("ema.dbc")
    if dbc is None:
        return Codec()
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "ema.dbc"
        path.write_bytes(dbc)
        return Codec(path)


def _columns(table: str, content: dict[str, Any]) -> list[Column]:
    if table == "status":
        return [*_STATUS, *(Column(name, "") for name in content.get("counters", {}))]
    return {"estimates": _ESTIMATES, "envelopes": _ENVELOPES, "events": _EVENTS}[table]


def _rows(table: str, columns: list[Column], content: dict[str, Any]) -> list[list[Any]]:
    if table == "estimates":
        flat = content | dict(zip(FAULTS, content["k"], strict=True))
        flat |= {f"sd_{k}": sd for k, sd in zip(FAULTS, content["sd"], strict=True)}
        return [[*_cells(flat | {"reasons": "|".join(content["reasons"])}, columns)]]
    if table == "envelopes":
        who = [content[column.name] for column in _WHO]
        points = zip(*(content[column.name] for column in _ENVELOPES[len(_WHO) :]), strict=True)
        return [[*who, *point] for point in points]
    if table == "status":
        return [_cells(content | content["counters"], columns)]
    return [_cells(content, columns)]


def _cells(content: dict[str, Any], columns: list[Column]) -> list[Any]:
    return [content.get(column.name) for column in columns]


def _block(table: str, columns: list[Column], rows: list[list[Any]]) -> Block:
    return Block(table, columns, [list(column) for column in zip(*rows, strict=True)])


def _signals(message: Message, bus: str, frames: np.ndarray, checks: np.ndarray) -> Block:
    lengths = {field.n_values for field in message.fields.values()}
    n = lengths.pop() if len(lengths) == 1 else 0  # samples in a frame, if that is what it holds
    repeat = max(n, 1)
    columns = [_T_NS, Column("bus", ""), Column("actuator", ""), Column("check", "")]
    values = [
        np.repeat(frames["t_ns"], repeat).tolist(),
        [bus] * (len(frames) * repeat),
        np.repeat(actuator(frames["id"]), repeat).tolist(),
        [Check(check).name.lower() for check in np.repeat(checks, repeat).tolist()],
    ]
    if n:
        columns.append(Column("sample", ""))
        values.append(list(range(n)) * len(frames))
    for name, data in message.decode(frames).items():
        unit = message.fields[name].unit or ("" if message.fields[name].is_count else "1")
        if n or data.ndim == 1:
            columns.append(Column(name, unit))
            values.append(data.reshape(-1).tolist())
        else:
            columns += [Column(part, unit) for part in _parts(name, data.shape[1])]
            values += data.T.tolist()
    return Block(message.name, columns, values)


def _parts(name: str, n: int) -> list[str]:
    """Names of a series' members as in the DBC."""
    if name.endswith("k"):
        return [name[:-1] + k for k in FAULTS]
    return [f"{name}_{i}" for i in range(n)]
