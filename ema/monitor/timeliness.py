"""How old an estimate may be when it is sent, and in which order: decided live, repeated by replay from the log.

No clock in here: the caller says when the cycle's last frame arrived and what time it is, by one monotonic clock.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum
from typing import NamedTuple

from ema.core.status import Reason, Status

from .outputs import Event, Identified, Level


class Untimely(StrEnum):
    """Codes of events that say an estimate came too late; their text begins with the method, as replay expects."""

    LATE = "late"
    OUTDATED = "outdated"


class Verdict(NamedTuple):
    """What becomes of an estimate: as it is sent and logged, its age [s], whether the bus gets it, what is told."""

    out: Identified
    age: float
    to_bus: bool
    event: Event | None


class Timeliness:
    """Judges the estimates of all actuators and methods as they are sent.

    Parameters
    ----------
    budget : callable
        From a method to the age beyond which its estimates are degraded. [s]
    """

    def __init__(self, budget: Callable[[str], float]):
        self._budget = budget
        self._newest: dict[tuple[int, str], float] = {}

    def judge(self, out: Identified, arrived: float, now: float) -> Verdict:
        """Judge an estimate of a cycle whose last frame arrived at `arrived`, sent at `now`. [s]"""
        method, age = out.estimate.method, max(0.0, now - arrived)
        newest = self._newest.setdefault((out.actuator, method), arrived)
        if arrived < newest:
            text = f"{method}: cycle {out.cycle} is answered after a newer one and is not sent"
            return Verdict(marked_late(out), age, False, _event(out, Untimely.OUTDATED, text))
        self._newest[out.actuator, method] = arrived
        budget = self._budget(method)
        if age > budget:
            text = f"{method}: cycle {out.cycle} is answered after {age:.2f} s, allowed are {budget:g} s"
            return Verdict(marked_late(out), age, True, _event(out, Untimely.LATE, text))
        return Verdict(out, age, True, None)


def marked_late(out: Identified) -> Identified:
    """The same estimate, degraded, because nobody may take it for the actuator's present state."""
    e = out.estimate
    return replace(out, estimate=replace(e, status=max(e.status, Status.DEGRADED), reasons=e.reasons | Reason.LATE))


def _event(out: Identified, code: Untimely, text: str) -> Event:
    return Event(out.t_ns, Level.WARNING, code, text, out.actuator)
