"""How a log is cut into segments, flushed and kept."""

from __future__ import annotations

from pydantic import Field

from ema.core.config import Settings
from ema.core.units import quantity


class LogSettings(Settings):
    """Section `log` of the daemon's configuration (without the directory)."""

    segment_size: quantity("MB", "a segment is closed at this size", gt=0) = 256.0  # type: ignore[valid-type]
    segment_time: quantity("s", "a segment is closed at this age", gt=0) = 600.0  # type: ignore[valid-type]
    flush_interval: quantity("s", "at most this much is lost on a power cut", ge=0.01, le=60) = 1.0  # type: ignore[valid-type]
    keep_segments: int = Field(default=1000, ge=2, description="the oldest segments beyond this many are deleted")
    keep_free: quantity("MB", "left free on the disk: old segments are deleted, then writing stops", ge=0) = 100.0  # type: ignore[valid-type]
