"""Messages of one MCAP file, whole, unfinished or damaged.

The `mcap` library reads the summary of a finished file, or stops at the first damage. This scanner needs no summary,
skips chunks outside the time range without decompressing them, checks what it reads against all that the file says of
itself (own lengths of records, CRCs, indexes, running numbers, the summary), and after damage goes on at the next sound
record. It holds one chunk in memory.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Metadata

from ema.core.errors import LogError
from ema.core.files import require_file

from . import records as at_rest
from .ledger import Ledger, Missing
from .numbered import CHANNELS
from .records import LIMIT, UNREADABLE, Block, ChunkHead, Place, parse
from .summary import Summary, contradictions, is_finished, read_summary
from .walk import DataSection, Index


class RawMessage(NamedTuple):
    """One message as stored."""

    topic: str
    t_ns: int
    data: bytes


class Damage(NamedTuple):
    """A place in a file that could not be read, or contradicts the rest."""

    path: Path
    offset: int
    what: str

    def __str__(self) -> str:
        return f"{self.path}: byte {self.offset}: {self.what}"


class NotMcapError(LogError):
    """A file holds nothing of an MCAP file."""

    def __init__(self, path: Path, what: str):
        super().__init__(f"{path}: {what}")
        self.what = what


class McapFile:
    """One MCAP file.

    Parameters
    ----------
    path : Path
        The file.
    report : callable
        Called with every `Damage` met.

    Attributes
    ----------
    missing : list of Missing
        Messages that were written and cannot be read; known when all blocks have been read.

    Raises
    ------
    LogError
        The file cannot be opened; NotMcapError where it holds nothing of an MCAP file.
    """

    def __init__(self, path: Path, report: Callable[[Damage], None] = lambda damage: None):
        self.path = path
        self._report = report
        self._topics: dict[int, str] = {}
        self._searched = False
        self._metadata: dict[str, str] | None = None
        self.missing: list[Missing] = []
        try:
            self._file = require_file(path).open("rb")
            self._size = self._file.seek(0, io.SEEK_END)
        except OSError as error:
            raise LogError(f"{path}: cannot be read ({error.strerror})") from error
        self._data = DataSection(self._size, self._read, self.note)
        if not self._data.is_marked:
            if self._data.begin >= self._size:
                self.close()
                raise NotMcapError(path, "is not an MCAP file" + (" (it is empty)" if self._size == 0 else ""))
            self.note(0, "does not begin as an MCAP file")

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    @property
    def finished(self) -> bool:
        """Whether the file was closed properly: a footer and the magic at its end."""
        return is_finished(self._size, self._read)

    def first_time(self) -> int | None:
        """Time of the first chunk's first message, None when there is none. [ns]"""
        for place in self._data.places():
            if place.opcode == Opcode.CHUNK and (head := at_rest.chunk_head(place, self._read)):
                if _vouched(head, self._data.index(place.end)[0]):
                    return head.first_ns
                data = at_rest.chunk_data(place, head, self._read)
                times = [message.t_ns for message in at_rest.block(place.offset, data).messages] if data else []
                if times:
                    return min(times)
            elif place.opcode == Opcode.MESSAGE:
                return int(at_rest.MESSAGE.unpack(self._read(place.begin, at_rest.MESSAGE.size))[2])
        return None

    def chunk_heads(self) -> Iterator[ChunkHead]:
        """What each chunk says of itself."""
        for place in self._data.places():
            if place.opcode == Opcode.CHUNK and (head := at_rest.chunk_head(place, self._read)):
                yield head

    def messages(
        self, wanted: Callable[[str], bool], start_ns: int | None = None, end_ns: int | None = None
    ) -> Iterator[RawMessage]:
        """Messages in the order of the file whose topic is `wanted` and whose time is in [start_ns, end_ns)."""
        low, high = start_ns or 0, 2**64 if end_ns is None else end_ns
        chosen: dict[str, bool] = {}
        for block in self.blocks(low, high):
            for message in block.messages:
                topic = self.topic(message.channel, block.offset)
                take = chosen.get(topic)
                if take is None:
                    take = chosen[topic] = bool(topic) and wanted(topic)
                if take and low <= message.t_ns < high:
                    yield RawMessage(topic, message.t_ns, block.data[message.begin : message.end])

    def blocks(self, start_ns: int = 0, end_ns: int = 2**64) -> Iterator[Block]:
        """Records of every sound chunk that overlaps the time range, and records outside of chunks.

        Behind the last one all is compared with what the file says of itself; see `missing`.
        """
        ledger = Ledger()
        alone = True

        def another() -> None:
            nonlocal alone
            alone = False
            ledger.again()

        before: Index = {}
        pairs: dict[str, str] = {}
        behind, n_attachments = 0, 0
        for place in self._data.places(another):
            if place.opcode == Opcode.CHUNK:
                index, behind = self._data.index(place.end)
                block = self._chunk(place, index, ledger, start_ns, end_ns)
                before = _index_of(block) if block else {}
            elif place.opcode == Opcode.MESSAGE_INDEX:
                if place.offset >= behind:
                    self._orphan(place, before, ledger)
                continue
            elif place.opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):
                block = at_rest.block(place.offset, self._read(place.offset, place.end - place.offset))
            else:
                n_attachments += place.opcode == Opcode.ATTACHMENT
                pairs |= self._pairs(place) if place.opcode == Opcode.METADATA else {}
                continue
            if block is not None:
                for message in block.messages:
                    ledger.take(message.channel, message.sequence, message.t_ns)
                self._topics |= self._defined(block)
                yield block
        self._metadata = pairs
        self._compare(ledger, n_attachments, alone)

    def attachments(self) -> Iterator[Attachment]:
        """Attached files."""
        for place in self._data.places():
            if place.opcode != Opcode.ATTACHMENT:
                continue
            content = at_rest.attachment(place, self._read)
            try:
                if content is None:
                    raise ValueError("CRC")
                yield parse(Attachment, content)
            except UNREADABLE:
                self.note(place.offset, "an attachment is damaged")

    def metadata(self) -> dict[str, str]:
        """Key-value pairs of the metadata records, joined."""
        if self._metadata is None:
            pairs: dict[str, str] = {}
            for place in self._data.places():
                pairs |= self._pairs(place) if place.opcode == Opcode.METADATA else {}
            self._metadata = pairs
        return self._metadata

    def topic(self, channel: int, offset: int) -> str:
        """Topic of a channel; empty, and noted, where it is not known."""
        if channel not in self._topics:
            self._search_definitions()
        if channel not in self._topics:
            self.note(offset, f"channel {channel} is not defined")
        return self._topics.get(channel, "")

    def repeated_definitions(self) -> list[tuple[int, bytes]]:
        """Opcode and content of the schemas and channels that a finished file repeats at its end."""
        return self._summary.definitions if self._summary else []

    def note(self, offset: int, what: str) -> None:
        """Report damage at a place in the file."""
        self._report(Damage(self.path, offset, what))

    @cached_property
    def _summary(self) -> Summary | None:
        summary = read_summary(self._size, self._read)
        if summary is None or summary.sound or self._data.summary_at is None:
            return summary
        return read_summary(self._size, self._read, self._data.summary_at)  # something before it is gone, or is new

    @cached_property
    def _contradictions(self) -> list[str]:
        summary = read_summary(self._size, self._read)
        return contradictions(summary, self._read) if summary else []

    def _pairs(self, place: Place) -> dict[str, str]:
        try:
            record = parse(Metadata, self._read(place.begin, min(place.length, LIMIT)))
        except UNREADABLE:
            self.note(place.offset, "metadata is damaged")
            return {}
        return dict(record.metadata) if record.name != CHANNELS else {}

    def _orphan(self, place: Place, before: Index, ledger: Ledger) -> None:
        """A message index that does not follow its chunk; one of the chunk `before` that was itself damaged does."""
        channel, entries = at_rest.message_index(place, self._read)
        if before.get(channel) != entries:
            self.note(place.offset, "a message index without its chunk")
            ledger.lose(channel, [t_ns for t_ns, _ in entries])

    def _chunk(self, place: Place, index: Index, ledger: Ledger, low: int, high: int) -> Block | None:
        """Records of a chunk; None when it is outside the time range, or damaged."""
        head = at_rest.chunk_head(place, self._read)
        if head and (head.last_ns < low or head.first_ns >= high) and _vouched(head, index):
            for channel, entries in index.items():
                ledger.leave(channel, len(entries))
            return None
        data = at_rest.chunk_data(place, head, self._read) if head else None
        if head is None or data is None:
            self.note(place.offset, "a chunk is damaged")
            for channel, entries in index.items():
                ledger.lose(channel, [t_ns for t_ns, _ in entries])
            return None
        block = at_rest.block(place.offset, data)
        times = [message.t_ns for message in block.messages] or [head.first_ns, head.last_ns]
        if not block.whole:
            self.note(place.offset, "a record in a chunk cannot be read")
        if len(data) != head.size or (min(times), max(times)) != (head.first_ns, head.last_ns):
            self.note(place.offset, "a chunk's times or size are not those of its messages")
        if index and _by_time(index) != _by_time(_index_of(block)):
            self.note(place.end, "an index of messages is not that of its chunk")
        return block

    def _search_definitions(self) -> None:
        """Channels whose definition was left out or is damaged: from the summary, metadata and all chunks."""
        if self._searched:
            return
        self._searched = True
        found = []
        for place in self._data.places():
            if place.opcode == Opcode.METADATA:
                found += _beside(self._read(place.begin, min(place.length, LIMIT)))
            elif place.opcode == Opcode.CHUNK and (head := at_rest.chunk_head(place, self._read)):
                data = at_rest.chunk_data(place, head, self._read)
                found += self._defined(at_rest.block(place.offset, data)) if data else []
        found += [_topic_of(channel) for channel in (self._summary.channels if self._summary else [])]
        for number, topic in found:
            self._topics.setdefault(number, topic)

    def _defined(self, block: Block) -> list[tuple[int, str]]:
        """Numbers and topics of the channels defined in a block."""
        found = []
        for place in block.definitions:
            try:
                if place.opcode == Opcode.CHANNEL:
                    found.append(_topic_of(parse(Channel, block.data[place.begin : place.end])))
            except UNREADABLE:
                self.note(block.offset, "a channel cannot be read")
        return found

    def _compare(self, ledger: Ledger, n_attachments: int, alone: bool) -> None:
        """Everything was read: is it what the file says of itself?"""
        summary = self._summary
        said = summary.statistics if summary and summary.sound and alone else None
        counts = dict(said.channel_message_counts) if said else {}
        if not ledger.channels | counts.keys() <= self._topics.keys():
            self._search_definitions()
        self.missing = ledger.missing(self._topics, counts)
        for what in self._contradictions:
            self.note(self._size, what)
        for missing in self.missing:
            self.note(self._size, str(missing))
        if ledger.out_of_order:
            self.note(self._size, "messages are not in the order in which they were written, or are there twice")
        if said and (surplus := ledger.surplus(counts)):
            self.note(self._size, f"{surplus} messages more than its summary says")
        if said and said.attachment_count != n_attachments:
            self.note(self._size, f"{n_attachments} attachments, its summary says {said.attachment_count}")

    def _read(self, offset: int, length: int) -> bytes:
        """At most `length` bytes from `offset`: fewer at the end of the file."""
        try:
            self._file.seek(offset)
            return self._file.read(max(0, min(length, self._size - offset)))  # `read` reserves what it is asked for
        except OSError as error:
            raise LogError(f"{self.path}: cannot be read at byte {offset} ({error.strerror})") from error


def _vouched(head: ChunkHead, index: Index) -> bool:
    """Whether a chunk's times are those of the index behind it."""
    times = [t_ns for entries in index.values() for t_ns, _ in entries]
    return bool(times) and (min(times), max(times)) == (head.first_ns, head.last_ns)


def _index_of(block: Block) -> Index:
    index: Index = {}
    for message in block.messages:
        index.setdefault(message.channel, []).append((message.t_ns, message.offset))
    return index


def _by_time(index: Index) -> Index:
    return {channel: sorted(entries) for channel, entries in index.items()}


def _topic_of(channel: Channel) -> tuple[int, str]:
    """Number and topic; that of a channel that is not JSON is empty."""
    return channel.id, channel.topic if channel.message_encoding == "json" else ""


def _beside(content: bytes) -> list[tuple[int, str]]:
    """Number and topic of the channel that a metadata record names (`numbered.NumberedWriter`)."""
    try:
        record = parse(Metadata, content)
        said = record.metadata
        return [(int(said["id"]), said["topic"] * (said["encoding"] == "json"))] if record.name == CHANNELS else []
    except (KeyError, *UNREADABLE):
        return []
