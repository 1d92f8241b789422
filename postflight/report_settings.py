"""What the report shows (config/report.yaml), and what it calls severe (config/alarms.yaml)."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from typing import Literal

import yaml
from pydantic import Field, field_validator

from ema.alarms import AlarmSettings
from ema.core import config, resources
from ema.core.config import Settings
from ema.core.errors import LogError
from ema.core.units import quantity
from ema.log.schemas import METHODS


class Severity(IntEnum):
    """How bad a fault is: the level of its condition, as the daemon's alarms judge it."""

    OK = 0
    WATCH = 1
    ALARM = 2


def shipped() -> AlarmSettings:
    """The thresholds that come with this software."""
    return config.load(resources.config("alarms.yaml"), AlarmSettings)


def of_log(attached: Mapping[str, bytes]) -> AlarmSettings | None:
    """The daemon's own thresholds among the files in its log; None where it was made without alarms.

    Raises
    ------
    LogError
        They are damaged.
    """
    text = attached.get("alarms.yaml")
    if text is None:
        return None
    try:
        return config.validate(yaml.safe_load(text), AlarmSettings, "alarms.yaml in the log")
    except (yaml.YAMLError, ValueError) as error:
        raise LogError("alarms.yaml in the log is damaged") from error


class ReportSettings(Settings):
    """The whole configuration of the report; `alarms` is a file of its own."""

    methods: list[str] = Field(default=["hf", "lf2", "linear"], min_length=1)
    recent: float = quantity("s", "age of the oldest estimate taken for the health", 60.0, gt=0)
    longest_gap: float = quantity("s", "a longer silence is a break, not time of operation", 60.0, gt=0)
    life_until: Literal["watch", "alarm"] = "alarm"
    alarms: AlarmSettings = Field(default_factory=shipped)

    @field_validator("methods")
    @classmethod
    def _in_logs(cls, methods: list[str]) -> list[str]:
        odd = sorted(set(methods) - set(METHODS))
        if odd:
            raise ValueError(f"identifier '{odd[0]}' is not in logs; {', '.join(METHODS)} are")
        return methods

    def life_threshold(self, fault: str) -> float:
        """k at which a fault's life ends."""
        return float(getattr(self.alarms.faults[fault], self.life_until))
