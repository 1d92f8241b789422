"""Whose turn it is to speak on the bus: two monitors must not both tell the faults of one actuator. Pure."""

from __future__ import annotations

from enum import Enum, auto

from ema.core.errors import OccupiedError
from ema.monitor.presence import Presence


class _State(Enum):
    LISTENING = auto()  # after the start: is another one there?
    SPEAKING = auto()
    STANDING_BY = auto()  # another one speaks


class Turn:
    """Decides when this monitor speaks.

    Parameters
    ----------
    presence : Presence
    bus : str
        Its name, for people.
    listen : float
        So long after the start another one is listened for. [s]
    standby : bool
        Take over when the other one falls silent; else another one is a reason not to start.
    """

    def __init__(self, presence: Presence, bus: str, listen: float, standby: bool):
        self.presence, self.listen = presence, listen
        self._bus, self._standby = bus, standby
        self._state = _State.LISTENING

    @property
    def listening(self) -> bool:
        """Whether it is not yet known if another monitor is there."""
        return self._state is _State.LISTENING

    @property
    def speaking(self) -> bool:
        """Whether this monitor may send."""
        return self._state is _State.SPEAKING

    def look(self, now: float, uptime: float) -> tuple[str, str] | None:
        """See who is there at `now`; code and text of an event, if anything has changed. [s]

        Raises
        ------
        OccupiedError
            Another monitor does what this one would.
        """
        other = self.presence.other(now)
        if self._state is _State.LISTENING and uptime >= self.listen:
            if other is not None and not self._standby:
                raise OccupiedError(
                    f"bus {self._bus}: {other} already; stop it, or let this one take over when it falls silent "
                    "(standby: true)"
                )
            self._state = _State.SPEAKING if other is None else _State.STANDING_BY
            return None if other is None else ("standby", f"standing by: {other}")
        if self._state is _State.STANDING_BY and other is None:
            self._state = _State.SPEAKING
            return "takeover", f"taken over: the other monitor has been silent for {self.presence.timeout:g} s"
        if self._state is _State.SPEAKING and self._standby and other is not None and other.uptime > uptime:
            self._state = _State.STANDING_BY
            return "standby", f"standing by again: {other}"
        return None
