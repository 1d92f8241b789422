"""From the estimates of one actuator to the conditions of its alarms."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ema.core.names import FAULTS
from ema.core.status import AlarmLevel, Reason, Status

from .causes import BLIND, MODEL
from .change import Measure
from .condition import Condition
from .settings import AlarmSettings
from .trend import ROOM, Trend, life

Condition_ = tuple[str, AlarmLevel, Measure]


class Judged(NamedTuple):
    """What alarms need of an estimate; arrays of shape (6,)."""

    t_ns: int
    actuator: int
    cycle: int
    k: np.ndarray
    sd: np.ndarray
    status: Status
    reasons: Reason

    @classmethod
    def of(cls, out: Any) -> Judged:
        """Of the monitor's answer (`ema.monitor.Identified`), as it made it: not what became of it on its way out."""
        e = out.estimate
        return cls(out.t_ns, out.actuator, out.cycle, e.k, e.sd, e.status, e.reasons)


class Judge:
    """Of one actuator."""

    def __init__(self, settings: AlarmSettings):
        self._settings = settings
        g, p = settings.growth, settings.persistence
        self._conditions = {
            **{k: Condition(settings.faults[k].setpoints, p, settings.hysteresis) for k in FAULTS},
            **{f"{k}_rate": Condition((g.watch, g.alarm), p, settings.hysteresis) for k in FAULTS},
            # of remaining life its inverse, so that more is worse
            **{
                f"{k}_life": Condition((1.0 / g.life_watch, 1.0 / g.life_alarm), p, settings.hysteresis) for k in FAULTS
            },
            BLIND.name: Condition((0.5, 0.5), p, 0.0),
        }
        self._trend = Trend(g.memory, g.per_kelvin, g.least, settings.longest_gap)
        self.temp_w = ROOM  # of the winding, as last heard [°C]
        self._t_ns = 0

    def conditions(self, judged: Judged) -> Iterator[Condition_]:
        """Levels of all conditions after one more cycle; those that it says nothing about are left out."""
        if self._t_ns and judged.t_ns - self._t_ns > self._settings.longest_gap * 1e9:
            for condition in self._conditions.values():
                condition.forget()
        self._t_ns = judged.t_ns
        blind = not self._counts(judged)
        level = self._conditions[BLIND.name].update(float(blind))
        yield BLIND.name, self._level(BLIND.name, level > AlarmLevel.NONE), Measure()
        if judged.status >= Status.INVALID:
            return
        yield MODEL.name, self._level(MODEL.name, bool(judged.reasons & Reason.MODEL_IN_DOUBT)), Measure()
        if not blind:
            yield from self._of_faults(judged)

    def _counts(self, judged: Judged) -> bool:
        """Whether an alarm may follow from it: never from an invalid estimate, from a degraded one as configured."""
        if judged.status >= Status.INVALID or not (np.isfinite(judged.k).all() and np.isfinite(judged.sd).all()):
            return False
        return judged.status == Status.VALID or not judged.reasons & self._settings.reasons_not_counted

    def _level(self, cause: str, holds: bool) -> AlarmLevel:
        return self._settings.supervision.level(cause) if holds else AlarmLevel.NONE

    def _of_faults(self, judged: Judged) -> Iterator[Condition_]:
        z, g = self._settings.deviations, self._settings.growth
        self._trend.update(judged.t_ns, judged.k, judged.sd, self.temp_w)
        line = self._trend.line()
        for j, name in enumerate(FAULTS):
            k, sd = float(judged.k[j]), float(judged.sd[j])
            low, high = k - z * sd, k + z * sd
            level = self._conditions[name].update(low)
            yield name, level, Measure(k, low, high, _limit(self._settings.faults[name].setpoints, level))
            if line is None:
                continue
            now, rate, sd_rate = (float(x[j]) for x in line)
            reach = g.deviations * sd_rate
            level = self._conditions[f"{name}_rate"].update(rate - reach)
            yield f"{name}_rate", level, Measure(rate, rate - reach, rate + reach, _limit((g.watch, g.alarm), level))
            grows = rate > reach
            soonest, latest = (
                life(now, rate, sd_rate, self._settings.faults[name].alarm, z) if grows else (np.inf, np.inf)
            )
            # what has passed its alarm level is told by the fault's own alarm
            level = self._conditions[f"{name}_life"].update(1.0 / soonest if soonest > 0.0 else 0.0)
            middle = (self._settings.faults[name].alarm - now) / rate if grows else np.inf
            yield f"{name}_life", level, Measure(middle, soonest, latest, _limit((g.life_watch, g.life_alarm), level))

    def snapshot(self) -> dict[str, Any]:
        """To be restored."""
        conditions = {name: condition.snapshot() for name, condition in self._conditions.items()}
        return {"t_ns": self._t_ns, "temp_w": self.temp_w, "trend": self._trend.snapshot(), "conditions": conditions}

    def restore(self, stored: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        self._t_ns, self.temp_w = int(stored["t_ns"]), float(stored["temp_w"])
        self._trend.restore(stored["trend"])
        for name, condition in self._conditions.items():
            condition.restore(stored["conditions"][name])


def _limit(setpoints: tuple[float, float], level: AlarmLevel) -> float:
    """The setpoint that a level has passed; the next one below it where there is none."""
    return setpoints[max(int(level), 1) - 1]
