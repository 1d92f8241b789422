"""What is an alarm (config/alarms.yaml): one schema for the daemon, the report and `ema watch`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, field_validator, model_validator

from ema.core.config import Settings
from ema.core.names import FAULTS
from ema.core.status import AlarmLevel, Reason
from ema.core.units import quantity

LevelName = Literal["none", "watch", "alarm"]


class Levels(Settings):
    """Setpoints of one fault, for the lower end of its interval."""

    watch: float = quantity("", "look at it at the next occasion", gt=0, le=1)
    alarm: float = quantity("", "repair before the next flight", gt=0, le=1)

    @model_validator(mode="after")
    def _ascending(self) -> Levels:
        if not self.watch < self.alarm:
            raise ValueError(f"watch must be below alarm, are {self.watch}, {self.alarm}")
        return self

    @property
    def setpoints(self) -> tuple[float, float]:
        """In the order of AlarmLevel, from WATCH."""
        return self.watch, self.alarm


class Persistence(Settings):
    """A condition comes, and goes, when it was so in m of the last n cycles with an estimate that counts."""

    m: int = Field(ge=1, le=1000)
    n: int = Field(ge=1, le=1000)

    @model_validator(mode="after")
    def _majority(self) -> Persistence:
        if not self.n / 2 < self.m <= self.n:
            raise ValueError(f"m must be more than half of n and at most n, are {self.m} of {self.n}")
        return self


class Growth(Settings):
    """Rate of change and remaining life, from estimates that are forgotten with time (`ema.alarms.trend`)."""

    memory: float = quantity("s", "time of operation after which an estimate weighs 1/e", 1800.0, gt=0)
    per_kelvin: float = quantity("1/K", "by which a kelvin of the winding may move k, one sd", 0.002, gt=0, le=1)
    deviations: float = quantity("", "of the rate, by which it must differ from 0 to be told", 5.0, ge=0, le=20)
    least: int = Field(default=20, ge=3, description="estimates before a rate is told")
    watch: float = quantity("1/h", "rate of k, lower end", gt=0)
    alarm: float = quantity("1/h", "rate of k, lower end", gt=0)
    life_watch: float = quantity("h", "time until the alarm level, earlier end", gt=0)
    life_alarm: float = quantity("h", "time until the alarm level, earlier end", gt=0)

    @model_validator(mode="after")
    def _ascending(self) -> Growth:
        if not self.watch < self.alarm:
            raise ValueError(f"watch must be below alarm, are {self.watch}, {self.alarm}")
        if not self.life_watch > self.life_alarm:
            raise ValueError(f"life_watch must be above life_alarm, are {self.life_watch}, {self.life_alarm}")
        return self


class Latching(Settings):
    """Which levels of a fault's own alarm stand, after their condition has gone, until somebody clears them."""

    watch: bool = False
    alarm: bool = True


class Supervision(Settings):
    """Level of each alarm that is not about a fault."""

    model_in_doubt: LevelName = "watch"
    no_estimate: LevelName = "alarm"
    silent: LevelName = "alarm"
    channel: LevelName = "alarm"
    second_monitor: LevelName = "watch"
    log: LevelName = "alarm"
    behind: LevelName = "watch"
    bus: LevelName = "watch"

    def level(self, cause: str) -> AlarmLevel:
        """Of a cause by its name."""
        return AlarmLevel[str(getattr(self, cause)).upper()]


class AlarmSettings(Settings):
    """The whole file."""

    deviations: float = quantity("", "standard deviations from k down to the lower end of its interval", 1.645, ge=0)
    faults: dict[str, Levels]
    persistence: Persistence = Persistence(m=3, n=5)
    hysteresis: float = quantity("", "share of a setpoint below which its condition goes", 0.2, ge=0, lt=1)
    latching: Latching = Latching()
    growth: Growth
    not_counted: list[str] = Field(default=[], description="reasons for which a degraded estimate does not count")
    supervision: Supervision = Supervision()
    longest_gap: float = quantity("s", "a longer silence is a break: cycles before it are not counted", 60.0, gt=0)
    longest_shelving: float = quantity("h", "an alarm is shelved for so long at most", 12.0, gt=0, le=1000)

    @field_validator("faults")
    @classmethod
    def _every_fault(cls, faults: dict[str, Levels]) -> dict[str, Levels]:
        odd = sorted(set(faults) ^ set(FAULTS))
        if odd:
            raise ValueError(f"must name {', '.join(FAULTS)}: {odd[0]} is missing or unknown")
        return faults

    @field_validator("not_counted")
    @classmethod
    def _known(cls, names: list[str]) -> list[str]:
        known = Reason(sum(Reason)).names
        odd = sorted(set(names) - set(known))
        if odd:
            raise ValueError(f"reason '{odd[0]}' is unknown; known: {', '.join(known)}")
        return names

    @property
    def reasons_not_counted(self) -> Reason:
        """As bits."""
        return Reason(sum(Reason[name.upper()] for name in self.not_counted))
