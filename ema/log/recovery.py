"""A finished copy of an unfinished or damaged MCAP file: everything sound in it, nothing else."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, NamedTuple

from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from ema.core.errors import LogError

from .ledger import Missing
from .numbered import NumberedWriter
from .reader import DAMAGE_KEY
from .records import UNREADABLE, Block, parse
from .scan import Damage, McapFile

_TOLD = 20  # damages named in the copy


class Recovered(NamedTuple):
    """What a recovery found."""

    source: Path
    target: Path
    messages: int
    first_ns: int | None
    last_ns: int | None
    damage: list[Damage]
    missing: list[Missing]


class Verdict(NamedTuple):
    """What a file says of itself, compared with what is in it."""

    finished: bool
    damage: list[Damage]

    @property
    def is_sound(self) -> bool:
        """Closed properly, and nothing contradicts anything."""
        return self.finished and not self.damage


def examine(path: Path) -> Verdict:
    """Read all of a file. LogError when it is no MCAP file."""
    damage: list[Damage] = []
    file = McapFile(path, damage.append)
    try:
        for _ in file.blocks():
            pass
        return Verdict(file.finished, list(dict.fromkeys(damage)))
    finally:
        file.close()


def is_sound(path: Path) -> bool:
    """Whether a file was closed properly and is all that it says. LogError when it is no MCAP file."""
    return examine(path).is_sound


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
            copy = _Copy(file, output)
            for block in file.blocks():
                copy.add(block)
            copy.finish(list(dict.fromkeys(damage)))
    except FileExistsError as error:
        raise LogError(f"{target}: exists, and is not overwritten") from error
    except OSError as error:
        raise LogError(f"{target}: cannot be written ({error.strerror})") from error
    finally:
        file.close()
    return Recovered(source, target, copy.count, copy.first, copy.last, list(dict.fromkeys(damage)), file.missing)


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


class _Copy:
    """The file that is written; numbers of schemas and channels are its own."""

    def __init__(self, file: McapFile, output: BinaryIO):
        self._file = file
        self._writer = NumberedWriter(output)
        self._writer.start(library="ema-monitor recover")
        self._writer.add_metadata("ema", {**file.metadata(), "recovered_from": file.path.name})
        for attachment in file.attachments():
            self._writer.add_attachment(
                attachment.create_time, attachment.log_time, attachment.name, attachment.media_type, attachment.data
            )
        self._schemas: dict[int, int] = {0: 0}
        self._channels: dict[int, int] = {}
        self._made: dict[tuple[object, ...], int] = {}
        self.count = 0
        self.first: int | None = None
        self.last: int | None = None

    def add(self, block: Block) -> None:
        """Take all messages of a block."""
        for place in block.definitions:
            try:
                self._define(place.opcode, block.data[place.begin : place.end])
            except UNREADABLE:
                self._file.note(block.offset, "a schema or channel cannot be read")
        for message in block.messages:
            if message.channel not in self._channels:
                self._from_summary(message.channel, block.offset)
            if message.channel in self._channels:
                self._writer.add(self._channels[message.channel], message.t_ns, block.data[message.begin : message.end])
                self.count += 1
                self.first = min(self.first or message.t_ns, message.t_ns)
                self.last = max(self.last or message.t_ns, message.t_ns)

    def finish(self, damage: list[Damage]) -> None:
        """Say in the copy what is missing in it, and end it."""
        if damage:
            told = [f"byte {one.offset}: {one.what}" for one in damage[:_TOLD]]
            self._writer.add_metadata("ema", {DAMAGE_KEY: "; ".join(told)})
        self._writer.finish()

    def _define(self, opcode: int, content: bytes) -> None:
        if opcode == Opcode.SCHEMA:
            schema = parse(Schema, content)
            new = (schema.name, schema.encoding, schema.data)
            if new not in self._made:
                self._made[new] = self._writer.register_schema(*new)
            self._schemas[schema.id] = self._made[new]
        else:
            channel = parse(Channel, content)
            self._channel(channel, self._schemas.get(channel.schema_id, 0))

    def _channel(self, channel: Channel, schema: int) -> None:
        new = (channel.topic, channel.message_encoding, schema, tuple(channel.metadata.items()))
        if new not in self._made:
            self._made[new] = self._writer.register_channel(
                channel.topic, channel.message_encoding, schema, channel.metadata
            )
        self._channels[channel.id] = self._made[new]

    def _from_summary(self, number: int, offset: int) -> None:
        """A channel whose definition was in a damaged chunk: a finished file repeats it at the end."""
        for opcode, content in self._file.repeated_definitions():
            self._define(opcode, content)
        if number not in self._channels and (topic := self._file.topic(number, offset)):
            self._channel(Channel(number, topic, "json", {}, 0), 0)
