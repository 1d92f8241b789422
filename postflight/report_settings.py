"""What the report calls severe (config/report.yaml)."""

from __future__ import annotations

from enum import IntEnum
from typing import Literal

from pydantic import Field, field_validator, model_validator

from ema.core.config import Settings
from ema.core.names import FAULTS
from ema.core.units import quantity
from ema.log.schemas import METHODS


class Severity(IntEnum):
    """How bad a fault is."""

    OK = 0
    WATCH = 1
    WARNING = 2
    ALARM = 3


class Thresholds(Settings):
    """Of one fault."""

    watch: float = quantity("", "look at it at the next occasion", gt=0, le=1)
    warning: float = quantity("", "plan the repair", gt=0, le=1)
    alarm: float = quantity("", "repair before the next flight", gt=0, le=1)

    @model_validator(mode="after")
    def _ascending(self) -> Thresholds:
        if not self.watch < self.warning < self.alarm:
            raise ValueError(f"watch, warning, alarm must ascend, are {self.watch}, {self.warning}, {self.alarm}")
        return self

    @property
    def levels(self) -> tuple[float, float, float]:
        """In the order of Severity, from WATCH."""
        return self.watch, self.warning, self.alarm


class ReportSettings(Settings):
    """The whole configuration of the report."""

    methods: list[str] = Field(default=["hf", "lf2", "linear"], min_length=1)
    recent: float = quantity("s", "age of the oldest estimate taken for the health", 60.0, gt=0)
    longest_gap: float = quantity("s", "a longer silence is a break, not time of operation", 60.0, gt=0)
    persistence: int = Field(default=3, ge=1, le=1000, description="estimates in a row that change the severity")
    severity: dict[str, Thresholds] = Field(description="by fault")
    life_until: Literal["watch", "warning", "alarm"] = "alarm"

    @field_validator("methods")
    @classmethod
    def _in_logs(cls, methods: list[str]) -> list[str]:
        odd = sorted(set(methods) - set(METHODS))
        if odd:
            raise ValueError(f"identifier '{odd[0]}' is not in logs; {', '.join(METHODS)} are")
        return methods

    @model_validator(mode="after")
    def _every_fault(self) -> ReportSettings:
        odd = sorted(set(self.severity) ^ set(FAULTS))
        if odd:
            raise ValueError(f"severity must name {', '.join(FAULTS)}: {odd[0]} is missing or unknown")
        return self

    def life_threshold(self, fault: str) -> float:
        """k at which a fault's life ends."""
        return float(getattr(self.severity[fault], self.life_until))
