"""What a person has chosen to see in `ema watch`, and what keys change. No terminal, no bus."""

from __future__ import annotations

from dataclasses import dataclass

from ema.alarms import Change
from ema.core.status import AlarmState

KEYS = "j/k choose, a acknowledge, f filter, space freeze, q quit"


@dataclass
class View:
    """The state of the picture.

    Attributes
    ----------
    only : int, str or None
        Only this actuator, or only those with alarms ("alarms"); None: everything.
    chosen : tuple or None
        Actuator (None: the monitor) and cause of the alarm that `a` acknowledges.
    """

    only: int | str | None = None
    chosen: tuple[int | None, str] | None = None
    frozen: bool = False
    quitting: bool = False

    def shows(self, actuator: int, alarms: list[Change]) -> bool:
        """Whether an actuator is to be seen."""
        if self.only == "alarms":
            return any(change.actuator == actuator for change in alarms)
        return self.only is None or self.only == actuator

    def choice(self, alarms: list[Change]) -> Change | None:
        """The chosen alarm, else the first."""
        found = [change for change in alarms if (change.actuator, change.cause) == self.chosen]
        return next(iter(found or alarms), None)

    def press(self, key: str, alarms: list[Change], actuators: list[int]) -> Change | None:
        """Take a key; the alarm that is to be acknowledged, if that was asked."""
        if key == "q":
            self.quitting = True
        elif key == " ":
            self.frozen = not self.frozen
        elif key == "f":
            choices = [None, "alarms", *actuators]
            place = choices.index(self.only) if self.only in choices else -1
            self.only = choices[(place + 1) % len(choices)]
        elif key in "jk" and alarms:
            here = alarms.index(self.choice(alarms))  # type: ignore[arg-type]
            there = alarms[max(0, min(len(alarms) - 1, here + (1 if key == "j" else -1)))]
            self.chosen = there.actuator, there.cause
        elif key == "a":
            change = self.choice(alarms)
            return change if change is not None and change.state == AlarmState.ACTIVE else None
        return None
