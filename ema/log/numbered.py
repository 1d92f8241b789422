"""The MCAP writer as all logs here are written: compressed, with every checksum, each channel's messages numbered."""

from __future__ import annotations

from collections import Counter
from typing import Any

from mcap.writer import CompressionType, Writer

CHANNELS = "channels"  # name of the metadata records that repeat what channels there are


class NumberedWriter(Writer):
    """Numbers the messages of each channel from 1 on, so that a reader sees what is missing even without a summary."""

    def __init__(self, output: Any, chunk_size: int = 1 << 20):
        super().__init__(output, chunk_size=chunk_size, compression=CompressionType.ZSTD, enable_data_crcs=True)
        self._numbers: Counter[int] = Counter()

    def add(self, channel: int, t_ns: int, data: bytes) -> None:
        """Add one message to the chunk in progress."""
        self._numbers[channel] += 1
        self.add_message(channel, t_ns, data, t_ns, self._numbers[channel])

    def register_channel(
        self, topic: str, message_encoding: str, schema_id: int, metadata: dict[str, str] | None = None
    ) -> int:
        """Define a channel in the chunk in progress and outside of it: a damaged chunk must not hide all the others."""
        number = int(super().register_channel(topic, message_encoding, schema_id, metadata or {}))
        self.add_metadata(CHANNELS, {"id": str(number), "topic": topic, "encoding": message_encoding})
        return number
