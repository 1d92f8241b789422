"""The states of one alarm (ISA-18.2, clause 10: alarm state transitions), and what an operator does to it."""

from __future__ import annotations

from dataclasses import dataclass, field

from ema.core.status import AlarmLevel, AlarmState

from .settings import Latching

_KEPT = ("condition", "level", "acknowledged", "since_cycle", "since_ns", "shelved_until_ns")


@dataclass
class Point:
    """One alarm of one cause.

    What is kept is small, and the state follows from it: an alarm stands at a level since its condition came; the
    condition may have gone meanwhile; somebody may have acknowledged it or put it on the shelf.

    Attributes
    ----------
    condition : AlarmLevel
        As judged last.
    level : AlarmLevel
        At which the alarm stands; of a latching one the highest since it came.
    since_cycle, since_ns : int
        When the condition of this level came.
    shelved_until_ns : int
        0: not shelved. [ns]
    """

    latching: Latching = field(repr=False)
    condition: AlarmLevel = AlarmLevel.NONE
    level: AlarmLevel = AlarmLevel.NONE
    acknowledged: bool = False
    since_cycle: int = 0
    since_ns: int = 0
    shelved_until_ns: int = 0

    @property
    def state(self) -> AlarmState:
        """Follows from the rest."""
        if self.shelved_until_ns:
            return AlarmState.SHELVED
        if self.level == AlarmLevel.NONE:
            return AlarmState.INACTIVE
        if self.condition == AlarmLevel.NONE:
            return AlarmState.LATCHED_CLEARED
        return AlarmState.ACKNOWLEDGED if self.acknowledged else AlarmState.ACTIVE

    def judge(self, condition: AlarmLevel, cycle: int, t_ns: int) -> None:
        """Take the level of the condition after a cycle."""
        came = condition > AlarmLevel.NONE and (self.condition == AlarmLevel.NONE or condition > self.level)
        self.condition = condition
        if came:
            self.level = max(condition, self.level)
            self.acknowledged = False
            self.since_cycle, self.since_ns = cycle, t_ns
        elif condition < self.level and not self._latches and (condition > AlarmLevel.NONE or self.acknowledged):
            self._fall(condition)

    @property
    def is_fresh(self) -> bool:
        """Whether nothing has ever happened to it."""
        return not (self.since_ns or self.shelved_until_ns)

    def acknowledge(self) -> bool:
        """Somebody has seen it; False where nothing stands."""
        if self.level == AlarmLevel.NONE:
            return False
        self.acknowledged = True
        if self.condition == AlarmLevel.NONE and not self._latches:
            self._fall(AlarmLevel.NONE)
        return True

    def clear(self) -> bool:
        """Give up one whose condition has gone; False where it has not, or nothing stands."""
        if self.level == AlarmLevel.NONE or self.condition > AlarmLevel.NONE:
            return False
        self._fall(AlarmLevel.NONE)
        return True

    def shelve(self, until_ns: int) -> bool:
        """Take it out of sight until then; it goes on being judged."""
        self.shelved_until_ns = until_ns
        return True

    def unshelve(self) -> bool:
        """Back into sight: what stands has to be acknowledged anew. False where it was not shelved."""
        if not self.shelved_until_ns:
            return False
        self.shelved_until_ns = 0
        self.acknowledged = False
        return True

    @property
    def _latches(self) -> bool:
        return self.level > AlarmLevel.NONE and bool(getattr(self.latching, self.level.name.lower()))

    def _fall(self, level: AlarmLevel) -> None:
        self.level = level
        if level == AlarmLevel.NONE:
            self.acknowledged = False

    def snapshot(self) -> dict[str, int]:
        """To be restored."""
        return {name: int(getattr(self, name)) for name in _KEPT}

    def restore(self, stored: dict[str, int]) -> None:
        """Go on from a snapshot."""
        self.condition, self.level = AlarmLevel(stored["condition"]), AlarmLevel(stored["level"])
        self.acknowledged = bool(stored["acknowledged"])
        for name in ("since_cycle", "since_ns", "shelved_until_ns"):
            setattr(self, name, int(stored[name]))
