"""A finished copy of an unfinished or damaged MCAP file: everything sound in it, nothing else."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Message, Schema
from mcap.writer import CompressionType, Writer

from ema.core.errors import LogError

from .scan import UNREADABLE, Damage, McapFile


class Recovered(NamedTuple):
    """What a recovery found."""

    source: Path
    target: Path
    messages: int
    first_ns: int | None
    last_ns: int | None
    damage: list[Damage]


def recover(source: Path, target: Path) -> Recovered:
    """Write everything that can be read from `source` into the new file `target`.

    Raises
    ------
    LogError
        `source` is no MCAP file or cannot be read, or `target` exists or cannot be written.
    """
    damage: list[Damage] = []
    file = McapFile(source, damage.append)
    try:
        with _new(target) as output:
            count, first, last = _copy(file, output)
    except FileExistsError as error:
        raise LogError(f"{target}: exists, and is not overwritten") from error
    except OSError as error:
        raise LogError(f"{target}: cannot be written ({error.strerror})") from error
    finally:
        file.close()
    return Recovered(source, target, count, first, last, list(dict.fromkeys(damage)))


@contextmanager
def _new(target: Path) -> Iterator[BinaryIO]:
    """A new file, which is only there afterwards if all of it could be written."""
    output = target.open("xb")
    try:
        with output:
            yield output
    except BaseException:
        target.unlink(missing_ok=True)
        raise


def is_sound(path: Path) -> bool:
    """Whether a file was closed properly and every chunk in it is whole. LogError when it is no MCAP file."""
    damage: list[Damage] = []
    file = McapFile(path, damage.append)
    try:
        for _ in file.blocks():
            if damage:
                break
        return file.finished and not damage
    finally:
        file.close()


def _copy(file: McapFile, output: Any) -> tuple[int, int | None, int | None]:
    writer = Writer(output, compression=CompressionType.ZSTD)
    writer.start(library="ema-monitor recover")
    writer.add_metadata("ema", {**file.metadata(), "recovered_from": file.path.name})
    for attachment in file.attachments():
        writer.add_attachment(
            attachment.create_time, attachment.log_time, attachment.name, attachment.media_type, attachment.data
        )
    schemas: dict[int, int] = {0: 0}
    channels: dict[int, int] = {}
    count, first, last = 0, None, None
    for offset, records in file.blocks():
        for record in _parse(records):
            if record is None:
                file.note(offset, "a record in a chunk cannot be read")
            elif isinstance(record, Schema):
                if record.id not in schemas:
                    schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data)
            elif isinstance(record, Channel):
                if record.id not in channels:
                    schema = schemas.get(record.schema_id, 0)
                    channels[record.id] = writer.register_channel(
                        record.topic, record.message_encoding, schema, record.metadata
                    )
            elif record.channel_id not in channels:
                file.note(offset, f"channel {record.channel_id} is not defined")
            else:
                writer.add_message(
                    channels[record.channel_id], record.log_time, record.data, record.publish_time, record.sequence
                )
                count += 1
                first = record.log_time if first is None else min(first, record.log_time)
                last = record.log_time if last is None else max(last, record.log_time)
    writer.finish()
    return count, first, last


def _parse(records: bytes) -> Iterator[Schema | Channel | Message | None]:
    """Schemas, channels and messages of a chunk; None for one that cannot be read."""
    stream = io.BytesIO(records)
    while len(head := stream.read(9)) == 9:
        opcode, length = head[0], int.from_bytes(head[1:], "little")
        content = ReadDataStream(io.BytesIO(stream.read(min(length, len(records)))))
        try:
            if opcode == Opcode.SCHEMA:
                yield Schema.read(content)
            elif opcode == Opcode.CHANNEL:
                yield Channel.read(content)
            elif opcode == Opcode.MESSAGE:
                yield Message.read(content, length)
        except UNREADABLE:
            yield None
