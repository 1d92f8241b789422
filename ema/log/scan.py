"""Messages of one MCAP file, whole, unfinished or damaged.

The `mcap` library reads the summary of a finished file, or stops at the first damage. This scanner needs no summary,
skips chunks outside the time range without decompressing them, checks every chunk's CRC, and after damage goes on at
the next sound chunk. It holds one chunk in memory.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Metadata
from mcap.writer import MCAP0_MAGIC

from ema.core.errors import LogError

_RECORD = struct.Struct("<BQ")  # opcode, length of the content
_CHUNK = struct.Struct("<QQQII")  # first and last time, size and CRC uncompressed, length of the compression's name
_MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
_COMPRESSION_AT = _RECORD.size + _CHUNK.size - 4  # of a chunk record: where resynchronisation looks for "zstd"
_COMPRESSION_MARK = b"\x04\x00\x00\x00zstd"
_LIMIT = 256 << 20  # larger chunks and attachments are damage, not data
_BLOCK = 1 << 20
_FOOTER_SIZE = _RECORD.size + 20 + len(MCAP0_MAGIC)
UNREADABLE = (McapError, struct.error, ValueError, OverflowError, zstandard.ZstdError)


class RawMessage(NamedTuple):
    """One message as stored."""

    topic: str
    t_ns: int
    data: bytes


class _Record(NamedTuple):
    opcode: int
    offset: int
    length: int  # of the content

    @property
    def begin(self) -> int:
        return self.offset + _RECORD.size

    @property
    def end(self) -> int:
        return self.begin + self.length


class Damage(NamedTuple):
    """A place in a file that could not be read."""

    path: Path
    offset: int
    what: str

    def __str__(self) -> str:
        return f"{self.path}: byte {self.offset}: {self.what}"


class McapFile:
    """One MCAP file.

    Parameters
    ----------
    path : Path
        The file.
    report : callable
        Called with every `Damage` met.

    Raises
    ------
    LogError
        The file cannot be opened, or holds nothing of an MCAP file.
    """

    def __init__(self, path: Path, report: Callable[[Damage], None] = lambda damage: None):
        self.path = path
        self._report = report
        self._topics: dict[int, str] = {}
        try:
            self._file = path.open("rb")
            self._size = self._file.seek(0, io.SEEK_END)
        except OSError as error:
            raise LogError(f"{path}: cannot be read ({error.strerror})") from error
        self._begin = len(MCAP0_MAGIC)
        if self._read(0, len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            self._begin = self._next_chunk(0)
            if self._begin == self._size:
                self.close()
                raise LogError(f"{path}: is not an MCAP file" + (" (it is empty)" if self._size == 0 else ""))
            self.note(0, "does not begin as an MCAP file")

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    @property
    def finished(self) -> bool:
        """Whether the file was closed properly: a footer and the magic at its end."""
        end = self._read(max(0, self._size - _FOOTER_SIZE), _FOOTER_SIZE)
        return end[:1] == bytes([Opcode.FOOTER]) and end.endswith(MCAP0_MAGIC)

    def first_time(self) -> int | None:
        """Time of the first chunk's first message, None when there is none. [ns]"""
        for record in self._records():
            head = self._read(record.begin, _CHUNK.size)
            if record.opcode == Opcode.CHUNK and len(head) == _CHUNK.size:
                return int(_CHUNK.unpack(head)[0])
            if record.opcode == Opcode.MESSAGE and record.length >= _MESSAGE.size:
                return int(_MESSAGE.unpack_from(head)[2])
        return None

    def messages(
        self, wanted: Callable[[str], bool], start_ns: int | None = None, end_ns: int | None = None
    ) -> Iterator[RawMessage]:
        """Messages in the order of the file whose topic is `wanted` and whose time is in [start_ns, end_ns)."""
        low, high = start_ns or 0, 2**64 if end_ns is None else end_ns
        chosen: dict[int, bool] = {}
        for offset, records in self.blocks(low, high):
            yield from self._pick(records, offset, chosen, wanted, low, high)

    def blocks(self, start_ns: int = 0, end_ns: int = 2**64) -> Iterator[tuple[int, bytes]]:
        """Offset and decompressed records of every sound chunk that overlaps the time range, and of records outside."""
        at = self._begin
        while record := self._record(at):
            at = record.end
            if record.opcode == Opcode.CHUNK:
                records = self._chunk(record, start_ns, end_ns)
                if records is None:
                    self.note(record.offset, "a chunk is damaged")
                    at = self._next_chunk(record.offset + 1)
                elif records:
                    yield record.offset, records
            elif record.opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):
                yield record.offset, self._read(record.offset, record.end - record.offset)

    def attachments(self) -> Iterator[Attachment]:
        """Attached files."""
        for record in self._records():
            if record.opcode != Opcode.ATTACHMENT:
                continue
            content = self._read(record.begin, min(record.length, _LIMIT))
            try:
                if zlib.crc32(content[:-4]) != int.from_bytes(content[-4:], "little"):
                    raise ValueError("CRC")
                yield Attachment.read(ReadDataStream(io.BytesIO(content)))
            except UNREADABLE:
                self.note(record.offset, "an attachment is damaged")

    def metadata(self) -> dict[str, str]:
        """Key-value pairs of all metadata records, joined."""
        pairs: dict[str, str] = {}
        for record in self._records():
            if record.opcode == Opcode.METADATA:
                content = self._read(record.begin, min(record.length, _LIMIT))
                try:
                    pairs |= Metadata.read(ReadDataStream(io.BytesIO(content))).metadata
                except UNREADABLE:
                    self.note(record.offset, "metadata is damaged")
        return pairs

    def _records(self) -> Iterator[_Record]:
        at = self._begin
        while record := self._record(at):
            yield record
            at = record.end

    def _record(self, offset: int) -> _Record | None:
        """The record at `offset`, or the next chunk behind damage; None at the end of the data section."""
        while offset < self._size:
            head = self._read(offset, _RECORD.size)
            opcode, length = _RECORD.unpack(head) if len(head) == _RECORD.size else (0, 0)
            if opcode == Opcode.DATA_END:
                return None
            record = _Record(opcode, offset, length)
            if 0 < opcode < Opcode.DATA_END and record.end <= self._size:
                return record
            found = self._next_chunk(offset + 1)
            at_end = found == self._size
            self.note(offset, "ends in the middle of a record (unfinished)" if at_end else "a record is damaged")
            offset = found
        return None

    def _chunk(self, record: _Record, low: int, high: int) -> bytes | None:
        """Uncompressed records of a chunk: none of them when it is outside the time range, None when it is damaged."""
        try:
            first, last, size, crc, name_length = _CHUNK.unpack(self._read(record.begin, _CHUNK.size))
            if last < low or first >= high:
                return b""
            content = self._read(record.begin + _CHUNK.size, min(record.length, _LIMIT) - _CHUNK.size)
            data = _decompress(content[:name_length], content[name_length + 8 :], size)
        except UNREADABLE:
            return None
        return data if crc in (0, zlib.crc32(data)) else None

    def _pick(
        self, records: bytes, offset: int, chosen: dict[int, bool], wanted: Callable[[str], bool], low: int, high: int
    ) -> Iterator[RawMessage]:
        at = 0
        while at + _RECORD.size <= len(records):
            opcode, length = _RECORD.unpack_from(records, at)
            at += _RECORD.size
            if opcode == Opcode.CHANNEL:
                self._learn(records[at : at + length], offset)
            elif opcode == Opcode.MESSAGE and _MESSAGE.size <= length <= len(records) - at:
                channel, _, t_ns, _ = _MESSAGE.unpack_from(records, at)
                take = chosen.get(channel)
                if take is None:
                    take = chosen[channel] = self._known(channel, offset) and wanted(self._topics[channel])
                if take and low <= t_ns < high:
                    yield RawMessage(self._topics[channel], t_ns, records[at + _MESSAGE.size : at + length])
            at += length

    def _learn(self, content: bytes, offset: int) -> None:
        try:
            channel = Channel.read(ReadDataStream(io.BytesIO(content)))
        except UNREADABLE:
            self.note(offset, "a channel cannot be read")
            return
        if channel.message_encoding == "json":
            self._topics[channel.id] = channel.topic
        else:
            self._topics.setdefault(channel.id, "")

    def _learn_from_summary(self) -> None:
        at = int.from_bytes(self._read(self._size - _FOOTER_SIZE + _RECORD.size, 8), "little") if self.finished else 0
        while 0 < at < self._size - _FOOTER_SIZE:
            record = _Record(self._read(at, 1)[0], at, int.from_bytes(self._read(at + 1, 8), "little"))
            if record.opcode == Opcode.CHANNEL:
                self._learn(self._read(record.begin, record.length), at)
            at = record.end

    def _known(self, channel: int, offset: int) -> bool:
        if channel not in self._topics:  # its definition was in a damaged chunk; a finished file repeats it at the end
            self._learn_from_summary()
        if channel not in self._topics:
            self.note(offset, f"channel {channel} is not defined")
        return channel in self._topics

    def _next_chunk(self, offset: int) -> int:
        """Offset of the next plausible chunk record that begins at or after `offset`; the file's size without one."""
        at = offset + _COMPRESSION_AT
        while at < self._size:
            block = self._read(at, _BLOCK + len(_COMPRESSION_MARK) - 1)
            found = block.find(_COMPRESSION_MARK)
            while found >= 0:
                start = at + found - _COMPRESSION_AT
                opcode, length = _RECORD.unpack(self._read(start, _RECORD.size))
                if opcode == Opcode.CHUNK and start + _RECORD.size + length <= self._size:
                    return start
                found = block.find(_COMPRESSION_MARK, found + 1)
            at += _BLOCK
        return self._size

    def _read(self, offset: int, length: int) -> bytes:
        """At most `length` bytes from `offset`: fewer at the end of the file."""
        try:
            self._file.seek(offset)
            return self._file.read(max(0, min(length, self._size - offset)))  # `read` reserves what it is asked for
        except OSError as error:
            raise LogError(f"{self.path}: cannot be read at byte {offset} ({error.strerror})") from error

    def note(self, offset: int, what: str) -> None:
        """Report damage at a place in the file."""
        self._report(Damage(self.path, offset, what))


def _decompress(compression: bytes, data: bytes, size: int) -> bytes:
    if size > _LIMIT or compression not in (b"", b"zstd"):
        raise ValueError("chunk too large, or compressed by something else")
    if not compression:
        return data
    if zstandard.frame_content_size(data) > _LIMIT:
        raise ValueError("chunk too large")
    return zstandard.decompress(data, max_output_size=size)
