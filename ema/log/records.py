"""Records of an MCAP file as bytes: how long each is by its own content, and what is in a chunk.

Opcode and length of a record are said once and protected by nothing. But most kinds also say within how long their
parts are, so that a wrong opcode or length contradicts the content, and the content tells what is right.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Callable
from typing import Any, NamedTuple

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode

RECORD = struct.Struct("<BQ")  # opcode, length of the content
MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
LIMIT = 256 << 20  # larger chunks and attachments are damage, not data
UNREADABLE = (McapError, struct.error, ValueError, OverflowError, zstandard.ZstdError)
Read = Callable[[int, int], bytes]  # at most so many bytes from an offset

_CHUNK = struct.Struct("<QQQII")  # first and last time, size and CRC uncompressed, length of the compression's name
_INDEX_ENTRY = struct.Struct("<QQ")  # time, offset in the chunk
_WINDOW = 64  # bytes that hold the beginning of most records
# Kind: where its content gives lengths (bytes to skip, width of the length, …), and the bytes after the last part.
_PARTS: dict[int, tuple[tuple[tuple[int, int], ...], int]] = {
    Opcode.HEADER: (((0, 4), (0, 4)), 0),
    Opcode.SCHEMA: (((2, 4), (0, 4), (0, 4)), 0),
    Opcode.CHANNEL: (((4, 4), (0, 4), (0, 4)), 0),
    Opcode.CHUNK: (((28, 4), (0, 8)), 0),
    Opcode.MESSAGE_INDEX: (((2, 4),), 0),
    Opcode.ATTACHMENT: (((16, 4), (0, 4), (0, 8)), 4),
    Opcode.METADATA: (((0, 4), (0, 4)), 0),
    Opcode.DATA_END: ((), 4),
}


class Place(NamedTuple):
    """Where a record is."""

    opcode: int
    offset: int
    length: int  # of the content

    @property
    def begin(self) -> int:
        """Offset of the content."""
        return self.offset + RECORD.size

    @property
    def end(self) -> int:
        """Offset behind the content."""
        return self.begin + self.length


class ChunkHead(NamedTuple):
    """What a chunk says of itself. Times in ns; `data` is the offset of the compressed records in the file."""

    first_ns: int
    last_ns: int
    size: int
    crc: int
    compression: bytes
    data: int


class Stored(NamedTuple):
    """A message in a block: its data is block[begin:end], its record begins at `offset` there."""

    channel: int
    sequence: int
    t_ns: int
    offset: int
    begin: int
    end: int


class Block(NamedTuple):
    """Uncompressed records of a chunk, or one record outside of chunks."""

    offset: int  # in the file
    data: bytes
    messages: list[Stored]
    definitions: list[Place]  # of schemas and channels, by offset in `data`
    whole: bool  # no record in it is cut off


def parse(kind: Any, content: bytes) -> Any:
    """A record of one of `mcap.records` from its content; one of UNREADABLE when it cannot be read."""
    return kind.read(ReadDataStream(io.BytesIO(content)))


def own_length(kind: int, offset: int, read: Read) -> int | None:
    """Length of the content of a record of this kind by the lengths in it; None where they cannot be had."""
    if kind not in _PARTS:
        return None
    window = read(offset, _WINDOW)
    begin = at = offset + RECORD.size
    parts, tail = _PARTS[kind]
    for skip, width in parts:
        at += skip
        said = window[at - offset : at - offset + width] if at - offset + width <= _WINDOW else read(at, width)
        if len(said) < width:
            return None
        at += width + int.from_bytes(said, "little")
    return at + tail - begin


def is_sound(place: Place, read: Read) -> bool:
    """Whether a record of the data section is as long as its content says."""
    if place.opcode == Opcode.MESSAGE:
        return place.length >= MESSAGE.size
    return own_length(place.opcode, place.offset, read) == place.length


def by_content(said: Place, size: int, read: Read) -> Place | None:
    """A record whose opcode or length is wrong, as its content says; None where that is not sure."""
    offset = said.offset
    for kind in (Opcode.CHUNK, Opcode.ATTACHMENT, Opcode.METADATA, Opcode.MESSAGE_INDEX, Opcode.DATA_END):
        length = own_length(kind, offset, read)
        if length is None or (place := Place(kind, offset, length)).end > size:
            continue
        if kind == Opcode.CHUNK:
            sure = _is_checked_chunk(place, read)
        elif kind == Opcode.ATTACHMENT:
            sure = attachment(place, read) is not None
        else:  # without a CRC: one of the two is right, and another sound record follows
            after = place_at(place.end, read)
            sure = after is not None and after.end <= size and is_sound(after, read)
            sure = sure and (said.opcode == kind or said.length == length)
        if sure:
            return place
    return None


def place_at(offset: int, read: Read) -> Place | None:
    """The record that begins at an offset, as it says; None at the end of the file."""
    head = read(offset, RECORD.size)
    if len(head) < RECORD.size:
        return None
    opcode, length = RECORD.unpack(head)
    return Place(opcode, offset, length)


def attachment(place: Place, read: Read) -> bytes | None:
    """Content of an attachment, None when its CRC says that it is damaged."""
    content = read(place.begin, min(place.length, LIMIT))
    sound = len(content) >= 4 and zlib.crc32(content[:-4]) == int.from_bytes(content[-4:], "little")
    return content if sound else None


def chunk_head(place: Place, read: Read) -> ChunkHead | None:
    """What a chunk says of itself."""
    window = read(place.begin, _CHUNK.size + 16)
    if len(window) < _CHUNK.size:
        return None
    first, last, size, crc, n = _CHUNK.unpack_from(window)
    if n > 16:
        return None
    return ChunkHead(first, last, size, crc, window[_CHUNK.size : _CHUNK.size + n], place.begin + _CHUNK.size + n + 8)


def chunk_data(place: Place, head: ChunkHead, read: Read) -> bytes | None:
    """Uncompressed records of a chunk; None when they cannot be had or their CRC is wrong."""
    try:
        data = _decompress(head.compression, read(head.data, min(place.end - head.data, LIMIT)), head.size)
    except UNREADABLE:
        return None
    return data if head.crc in (0, zlib.crc32(data)) else None


def block(offset: int, data: bytes) -> Block:
    """The records in the data of a chunk told apart."""
    messages, definitions = [], []
    at, size = 0, len(data)
    while at + RECORD.size <= size:
        opcode, length = RECORD.unpack_from(data, at)
        begin, end = at + RECORD.size, at + RECORD.size + length
        if end > size:
            break
        if opcode == Opcode.MESSAGE and length >= MESSAGE.size:
            channel, sequence, t_ns, _ = MESSAGE.unpack_from(data, begin)
            messages.append(Stored(channel, sequence, t_ns, at, begin + MESSAGE.size, end))
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            definitions.append(Place(opcode, at, length))
        else:
            break
        at = end
    return Block(offset, data, messages, definitions, at == size)


def message_index(place: Place, read: Read) -> tuple[int, list[tuple[int, int]]]:
    """Channel, and time and offset of each of its messages in the chunk before."""
    content = read(place.begin, min(place.length, LIMIT))
    whole = content[: 6 + (len(content) - 6) // _INDEX_ENTRY.size * _INDEX_ENTRY.size]
    return int.from_bytes(content[:2], "little"), list(_INDEX_ENTRY.iter_unpack(whole[6:]))


def _is_checked_chunk(place: Place, read: Read) -> bool:
    head = chunk_head(place, read)
    return head is not None and head.crc != 0 and chunk_data(place, head, read) is not None


def _decompress(compression: bytes, data: bytes, size: int) -> bytes:
    if size > LIMIT or compression not in (b"", b"zstd"):
        raise ValueError("chunk too large, or compressed by something else")
    if not compression:
        return data
    if zstandard.frame_content_size(data) > LIMIT:
        raise ValueError("chunk too large")
    return zstandard.decompress(data, max_output_size=size)
