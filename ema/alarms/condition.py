"""Whether a quantity is beyond its setpoints: persistence and hysteresis, nothing else."""

from __future__ import annotations

from collections import deque

from ema.core.status import AlarmLevel

from .settings import Persistence


class Condition:
    """Level of one quantity, judged cycle by cycle.

    The condition of a level comes when m of the last n values were at or above its setpoint, and goes when m of them
    were below the setpoint less the hysteresis. What lies between speaks for neither.

    Parameters
    ----------
    setpoints : (watch, alarm)
    persistence : Persistence
    hysteresis : float
        Share of the setpoint.
    """

    def __init__(self, setpoints: tuple[float, float], persistence: Persistence, hysteresis: float):
        self.setpoints = setpoints
        self._m, self._hysteresis = persistence.m, hysteresis
        self._values: deque[float] = deque(maxlen=persistence.n)
        self.level = AlarmLevel.NONE

    def update(self, value: float) -> AlarmLevel:
        """Take the value of the next cycle; the level now."""
        self._values.append(value)
        if self.level == AlarmLevel.NONE and not value >= self.setpoints[0]:
            return self.level  # the usual case: nothing comes by a value below every setpoint
        level = AlarmLevel.NONE
        for candidate, setpoint in zip((AlarmLevel.WATCH, AlarmLevel.ALARM), self.setpoints, strict=True):
            if self._holds(candidate, setpoint):
                level = candidate
        self.level = level
        return level

    def forget(self) -> None:
        """Cycles so far say nothing about those that come; the level stays until they do."""
        self._values.clear()

    def _holds(self, level: AlarmLevel, setpoint: float) -> bool:
        if self.level >= level:
            return sum(value < setpoint * (1.0 - self._hysteresis) for value in self._values) < self._m
        return sum(value >= setpoint for value in self._values) >= self._m

    def snapshot(self) -> dict[str, object]:
        """To be restored."""
        return {"level": int(self.level), "values": list(self._values)}

    def restore(self, stored: dict) -> None:
        """Go on from a snapshot."""
        self.level = AlarmLevel(stored["level"])
        self._values.clear()
        self._values.extend(float(value) for value in stored["values"])
