"""Numeric series to files that Foxglove, PlotJuggler, asammdf and pandas open without a plug-in."""

from __future__ import annotations

import json
from abc import abstractmethod
from collections import Counter
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, BinaryIO

from ema.core.closing import Closing
from ema.core.errors import LogError
from ema.log.numbered import NumberedWriter
from ema.log.schemas import to_json

from .numeric import Series
from .table_files import TableFiles
from .tables import Block, Column

SUFFIXES = (".mcap", ".mf4")
TOPIC = "/signals/"


class NumericFile(Closing):
    """Takes series, in parts. `n` counts what was written of each channel."""

    def __init__(self, out: Path) -> None:
        self.out = out
        self.n: Counter[str] = Counter()

    def write(self, series: Series) -> None:
        """Append samples to their channel."""
        self._write(series)
        self.n[series.channel] += len(series.t_ns)

    def check(self) -> None:
        """LogError where the finished file holds other numbers of samples than were written."""
        held = self._held()
        wrong = [f"{held.get(name, 0)} of {n} samples of {name}" for name, n in self.n.items() if held.get(name) != n]
        if wrong or len(held) != len(self.n):
            raise LogError(f"{self.out}: holds {', '.join(wrong) or 'channels that were not written'}")

    @abstractmethod
    def _write(self, series: Series) -> None: ...

    @abstractmethod
    def _held(self) -> dict[str, int]: ...


class McapSeries(NumericFile):
    """MCAP: a channel of JSON with its schema for each series, a message for each sample."""

    def __init__(self, out: Path):
        super().__init__(out)
        self._file: BinaryIO = out.open("xb")
        self._writer = NumberedWriter(self._file)
        self._writer.start(library="ema-monitor export")
        self._channels: dict[str, tuple[int, tuple[str, ...]]] = {}

    def _write(self, series: Series) -> None:
        if series.channel not in self._channels:
            schema = self._writer.register_schema(f"ema.signals.{series.channel}", "jsonschema", schema_of(series))
            number = self._writer.register_channel(TOPIC + series.channel, "json", schema)
            self._channels[series.channel] = number, tuple(series.values)
        number, fields = self._channels[series.channel]
        columns = [series.values[name].tolist() for name in fields]
        for t_ns, *row in zip(series.t_ns.tolist(), *columns, strict=True):
            self._writer.add(number, max(0, t_ns), to_json(dict(zip(fields, row, strict=True))))

    def _held(self) -> dict[str, int]:
        from mcap.reader import make_reader

        with self.out.open("rb") as file:
            summary = make_reader(file).get_summary()
        if summary is None or summary.statistics is None:
            return {}
        counts = summary.statistics.channel_message_counts
        return {one.topic.removeprefix(TOPIC): counts.get(one.id, 0) for one in summary.channels.values()}

    def close(self) -> None:
        """Finish the file."""
        if not self._file.closed:
            self._writer.finish()
            self._file.close()


class Mf4Series(NumericFile):
    """MF4: a channel group for each series, its times in seconds since the first sample of all."""

    def __init__(self, out: Path):
        super().__init__(out)
        try:
            from asammdf import MDF, Signal
        except ImportError as error:
            raise LogError("MF4 needs asammdf: pip install 'ema-monitor[analyse]'") from error
        if out.exists():
            raise FileExistsError(None, "exists", str(out))
        self._signal = Signal
        self._mdf: Any = MDF(version="4.10")
        self._groups: dict[str, int] = {}
        self._first_ns: int | None = None
        self._saved = False

    def _write(self, series: Series) -> None:
        if self._first_ns is None:
            self._first_ns = int(series.t_ns[0])
            self._mdf.start_time = datetime.fromtimestamp(self._first_ns / 1e9, UTC)
        t = (series.t_ns - self._first_ns) / 1e9
        if series.channel in self._groups:
            samples = [(values, None) for values in series.values.values()]
            self._mdf.extend(self._groups[series.channel], [(t, None), *samples])
            return
        signals = [
            self._signal(values, t, unit=series.units[name], name=f"{series.channel}.{name}")
            for name, values in series.values.items()
        ]
        self._groups[series.channel] = int(self._mdf.append(signals, acq_name=series.channel, common_timebase=True))

    def _held(self) -> dict[str, int]:
        from asammdf import MDF

        back: Any
        with MDF(self.out) as back:
            return {group.channel_group.acq_name: int(group.channel_group.cycles_nr) for group in back.groups}

    def close(self) -> None:
        """Finish the file."""
        if not self._saved:
            self._saved = True
            if self._groups:
                self._mdf.save(self.out, overwrite=False)
            self._mdf.close()


class TableSeries(NumericFile):
    """A folder of Parquet or CSV files, one for each series, with the time in ns."""

    def __init__(self, out: Path, kind: str):
        super().__init__(out)
        self._files = TableFiles(out, kind)

    def _write(self, series: Series) -> None:
        columns = [Column("t_ns", "ns"), *(Column(name, series.units[name]) for name in series.values)]
        values = [series.t_ns.tolist(), *(v.tolist() for v in series.values.values())]
        self._files.write(Block(series.channel.replace("/", "-"), columns, values))

    def _held(self) -> dict[str, int]:
        names = {name.replace("/", "-"): name for name in self.n}
        return {names[path.stem]: rows for path, rows in self._files.held().items()}

    def close(self) -> None:
        """Finish all files."""
        self._files.close()


def open_numeric(out: Path, kind: str) -> NumericFile:
    """The file or folder for a path: by its suffix, else tables of a kind. FileExistsError where it is there."""
    if out.suffix.lower() == ".mcap":
        return McapSeries(out)
    if out.suffix.lower() == ".mf4":
        return Mf4Series(out)
    if out.suffix:
        raise LogError(f"{out}: signals go to NAME.mcap, NAME.mf4 or a folder of tables")
    return TableSeries(out, kind)


def schema_of(series: Series) -> bytes:
    """JSON schema of one sample."""
    fields = {
        name: {"type": "number", "description": f"{name} [{series.units[name]}]", "unit": series.units[name]}
        for name in series.values
    }
    return json.dumps({"title": series.channel, "type": "object", "properties": fields}, ensure_ascii=False).encode()
