"""How a log is cut into segments, flushed and kept."""

from __future__ import annotations

from pydantic import Field, model_validator

from ema.core.config import Settings
from ema.core.units import quantity


class LogSettings(Settings):
    """Section `log` of the daemon's configuration (without the directory)."""

    segment_size: float = quantity("MB", "a segment is closed at this size", 256.0, gt=0)
    segment_time: float = quantity("s", "a segment is closed at this age", 600.0, gt=0)
    flush_interval: float = quantity("s", "at most this much is lost on a power cut", 1.0, ge=0.01, le=60)
    keep_segments: int = Field(default=1000, ge=2, description="the oldest segments beyond this many are deleted")
    keep_least: int = Field(
        default=2, ge=1, description="the newest segments that are never deleted, however full the disk is"
    )
    keep_free: float = quantity("MB", "left free on the disk: old segments go, then writing stops", 100.0, ge=0)

    @model_validator(mode="after")
    def _keeps_what_it_must(self) -> LogSettings:
        if self.keep_least > self.keep_segments:
            raise ValueError(f"keep_least {self.keep_least} is more than keep_segments {self.keep_segments}")
        return self
