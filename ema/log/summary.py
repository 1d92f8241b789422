"""What a finished MCAP file says of itself: counts by channel, checksums."""

from __future__ import annotations

import zlib
from typing import NamedTuple

from mcap.opcode import Opcode
from mcap.records import Channel, Schema, Statistics
from mcap.writer import MCAP0_MAGIC

from .records import LIMIT, RECORD, UNREADABLE, Read, parse, place_at

_FOOTER = 20  # length of a footer's content: where the summary and its offsets begin, CRC
FOOTER_SIZE = RECORD.size + _FOOTER + len(MCAP0_MAGIC)
_DATA_END_SIZE = RECORD.size + 4
_BLOCK = 1 << 20


class Summary(NamedTuple):
    """The summary of a finished file.

    Attributes
    ----------
    data_end : int
        Offset of the record that ends the data section.
    definitions : list of opcode and content
        Of schemas and channels, repeated from the data section.
    statistics : Statistics or None
    sound : bool
        Its checksum is right and every record in it can be read.
    """

    data_end: int
    definitions: list[tuple[int, bytes]]
    statistics: Statistics | None
    sound: bool

    @property
    def channels(self) -> list[Channel]:
        """The channels, as far as they can be read."""
        return [parse(Channel, content) for opcode, content in self.definitions if opcode == Opcode.CHANNEL]


def is_finished(size: int, read: Read) -> bool:
    """Whether a file was closed properly: a footer and the magic at its end."""
    end = read(max(0, size - FOOTER_SIZE), FOOTER_SIZE)
    return end[: RECORD.size] == RECORD.pack(Opcode.FOOTER, _FOOTER) and end.endswith(MCAP0_MAGIC)


def read_summary(size: int, read: Read, found_at: int | None = None) -> Summary | None:
    """The summary, where the footer says that it begins or where it was found.

    None of an unfinished file, and of one that was written without.
    """
    if not is_finished(size, read):
        return None
    footer = size - FOOTER_SIZE
    content = read(footer + RECORD.size, _FOOTER)
    said, crc = int.from_bytes(content[:8], "little"), int.from_bytes(content[-4:], "little")
    if said == 0:
        return None
    start = said if found_at is None else found_at
    definitions: list[tuple[int, bytes]] = []
    statistics = None
    sound = start <= footer and crc in (0, _crc(start, size - len(MCAP0_MAGIC) - 4, read))
    at = start
    while at < footer and (place := place_at(at, read)) is not None and place.end <= footer:
        try:
            content = read(place.begin, min(place.length, LIMIT))
            if place.opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                parse(Schema if place.opcode == Opcode.SCHEMA else Channel, content)
                definitions.append((place.opcode, content))
            elif place.opcode == Opcode.STATISTICS:
                statistics = parse(Statistics, content)
        except UNREADABLE:
            sound = False
        at = place.end
    return Summary(start - _DATA_END_SIZE, definitions, statistics, sound and at == footer)


def contradictions(summary: Summary, read: Read) -> list[str]:
    """What the checksums of summary and data section say against the file."""
    found = [] if summary.sound else ["its summary is damaged"]
    end = place_at(summary.data_end, read) if summary.data_end >= 0 else None
    if end is None or (end.opcode, end.length) != (Opcode.DATA_END, 4):
        found.append("its data do not end where the footer says")
    else:
        crc = int.from_bytes(read(end.begin, 4), "little")
        if crc not in (0, _crc(0, summary.data_end, read)):
            found.append("its data differ from their checksum")
    return found


def _crc(begin: int, end: int, read: Read) -> int:
    crc = 0
    for at in range(begin, end, _BLOCK):
        crc = zlib.crc32(read(at, min(_BLOCK, end - at)), crc)
    return crc
