"""One MCAP file being written, so that what a full disk refuses is kept and written later, byte for byte."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from .numbered import NumberedWriter
from .schemas import Encoded, Kind

BEFORE_KEY = "segment_before"  # in the metadata: its name, so that one that is taken away is missed
_CHUNK_SIZE = 4 << 20
_MEDIA_TYPES = {".dbc": "text/plain", ".yaml": "application/yaml", ".json": "application/json"}


class _Tail:
    """What the MCAP writer has produced and the file has not yet taken."""

    def __init__(self) -> None:
        self.pending = bytearray()
        self._written = 0

    def write(self, data: bytes) -> int:
        self.pending += data
        return len(data)

    def tell(self) -> int:
        return self._written + len(self.pending)

    def flush(self) -> None:
        """Nothing: the segment decides when bytes go to the file."""

    def move_to(self, descriptor: int) -> None:
        while self.pending:
            count = os.write(descriptor, self.pending)
            self._written += count
            del self.pending[:count]


class Segment:
    """A new MCAP file with all attachments in it, on the disk when the constructor returns.

    Every method raises OSError when the device refuses; nothing is lost then, the call can be repeated.
    """

    def __init__(self, path: Path, t_ns: int, attachments: Mapping[str, bytes], metadata: Mapping[str, str]):
        self.path = path
        self._tail = _Tail()
        self._writer = NumberedWriter(self._tail, chunk_size=_CHUNK_SIZE)
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self.finishing = False
        self._writer.start(profile="", library="ema-monitor")
        self._writer.add_metadata("ema", dict(metadata))
        for name, data in attachments.items():
            self._writer.add_attachment(
                t_ns, t_ns, name, _MEDIA_TYPES.get(Path(name).suffix, "application/octet-stream"), data
            )
        # Last, so that a process which is killed hardly ever leaves a file with nothing in it.
        self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        try:
            self.commit()
            _sync_directory(path.parent)
        except OSError:
            os.close(self._descriptor)
            path.unlink(missing_ok=True)
            raise

    @property
    def size(self) -> int:
        """Bytes of the file once everything is written."""
        return self._tail.tell()

    @property
    def pending(self) -> int:
        """Bytes not yet in the file."""
        return len(self._tail.pending)

    def add(self, message: Encoded) -> None:
        """Add one message to the chunk in progress."""
        channel = self._channels.get(message.topic)
        if channel is None:
            channel = self._channels[message.topic] = self._register(message.kind, message.topic)
        self._writer.add(channel, message.t_ns, message.data)

    def commit(self) -> None:
        """End the chunk in progress and have everything on the disk."""
        if not self.finishing:
            self._writer.flush()
        self._tail.move_to(self._descriptor)
        os.fdatasync(self._descriptor)

    def finish(self) -> None:
        """Write summary and footer and close the file."""
        if not self.finishing:
            self._writer.finish()
            self.finishing = True  # the summary is in the tail: a repeated call only moves it to the file
        self.commit()
        os.close(self._descriptor)

    def abandon(self) -> None:
        """Close the file as it is."""
        os.close(self._descriptor)

    def _register(self, kind: Kind, topic: str) -> int:
        if kind.name not in self._schemas:
            self._schemas[kind.name] = self._writer.register_schema(kind.name, "jsonschema", kind.schema_text)
        return int(self._writer.register_channel(topic, "json", self._schemas[kind.name]))


def _sync_directory(directory: Path) -> None:
    descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
