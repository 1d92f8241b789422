"""The data section of an MCAP file, record by record: behind damage it goes on where it is sure what a record is."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator

from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from .records import RECORD, Place, Read, by_content, is_sound, message_index, place_at
from .summary import is_finished

Index = dict[int, list[tuple[int, int]]]  # time and offset of each message in a chunk, by channel
_COMPRESSION_AT = RECORD.size + 28  # of a chunk record: where resynchronisation looks for "zstd"
_COMPRESSION_MARK = b"\x04\x00\x00\x00zstd"
_BLOCK = 1 << 20


class DataSection:
    """All records before the summary.

    Parameters
    ----------
    size : int
        Of the file. [B]
    read : callable
        At most so many bytes from an offset.
    note : callable
        Called with offset and words for every damage.

    Attributes
    ----------
    begin : int
        Offset of the first record; `size` where there is none.
    summary_at : int or None
        Offset of the summary as found, whatever the footer says.
    """

    def __init__(self, size: int, read: Read, note: Callable[[int, str], None]):
        self._size, self._read, self._note = size, read, note
        self.summary_at: int | None = None
        self.begin = len(MCAP0_MAGIC)
        self.is_marked = read(0, len(MCAP0_MAGIC)) == MCAP0_MAGIC
        if not self.is_marked and not is_sound(self._place(self.begin)._replace(opcode=Opcode.HEADER), read):
            self.begin = self._next_chunk(0)

    def places(self, another: Callable[[], None] = lambda: None) -> Iterator[Place]:
        """Sound records; `another` is called where a second file begins within the file."""
        at = self.begin
        while at < self._size:
            place = self._place(at)
            if place.opcode == Opcode.DATA_END and place.length == 4:
                self.summary_at = place.end
                at = self._behind_summary(place.end)
                if at < self._size:
                    self._note(at, f"goes on behind its end ({self._size - at} bytes)")
                    another()
                continue
            if self._read(at, len(MCAP0_MAGIC)) == MCAP0_MAGIC:
                at += len(MCAP0_MAGIC)
                continue
            if place.end <= self._size and is_sound(place, self._read):
                yield place
                at = place.end
                continue
            at = yield from self._mended(place)

    def _mended(self, place: Place) -> Generator[Place, None, int]:
        """A record that is not what it says: what it is by its content, or nothing; where to go on."""
        found = by_content(place, self._size, self._read)
        if found is not None:
            self._note(place.offset, "opcode or length of a record is wrong")
            if found.opcode == Opcode.DATA_END:
                return found.end if self._behind_summary(found.end) < self._size else self._size
            yield found
            return found.end
        after = self._place(place.end) if place.end < self._size else None
        if after is not None and is_sound(after, self._read):
            self._note(place.offset, "a record is damaged")
            return place.end
        at = self._next_chunk(place.offset + 1)
        ends = at == self._size and not is_finished(self._size, self._read)
        self._note(place.offset, "ends in the middle of a record (unfinished)" if ends else "a record is damaged")
        return at

    def index(self, at: int) -> tuple[Index, int]:
        """The message indexes that begin at an offset, and where they end."""
        index: Index = {}
        while at < self._size:
            place = self._place(at)
            if place.opcode != Opcode.MESSAGE_INDEX or place.end > self._size or not is_sound(place, self._read):
                break
            channel, entries = message_index(place, self._read)
            if channel in index:  # of a chunk that is gone
                break
            index[channel] = entries
            at = place.end
        return index, at

    def _behind_summary(self, at: int) -> int:
        """Where the summary that begins at an offset ends: behind the magic, or at the end of the file."""
        while at < self._size:
            block = self._read(at, _BLOCK + len(MCAP0_MAGIC) - 1)
            found = block.find(MCAP0_MAGIC)
            if found >= 0:
                return at + found + len(MCAP0_MAGIC)
            at += _BLOCK
        return self._size

    def _next_chunk(self, offset: int) -> int:
        """Offset of the next sound chunk that begins at or after `offset`; the file's size without one."""
        at = offset + _COMPRESSION_AT
        while at < self._size:
            block = self._read(at, _BLOCK + len(_COMPRESSION_MARK) - 1)
            found = block.find(_COMPRESSION_MARK)
            while found >= 0:
                start = at + found - _COMPRESSION_AT
                place = self._place(start)
                sound = place.opcode == Opcode.CHUNK and place.end <= self._size and is_sound(place, self._read)
                if sound or by_content(place, self._size, self._read) is not None:
                    return start
                found = block.find(_COMPRESSION_MARK, found + 1)
            at += _BLOCK
        return self._size

    def _place(self, offset: int) -> Place:
        """The record at an offset as it says; one of no kind at the end of the file."""
        return place_at(offset, self._read) or Place(0, offset, 0)
