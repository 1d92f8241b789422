"""Alarms in the daemon: from what it hears and estimates to the bus, the log and the journal."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from typing import Any

import numpy as np

from ema.alarms import Alarms, AlarmSettings, Change, Command, Heard, Judged
from ema.alarms.bus import ALARM, Ears, alarm_values
from ema.alarms.change import said
from ema.alarms.supervision import conditions
from ema.bus import identifiers
from ema.bus.codec import Codec
from ema.bus.protection import Sender
from ema.core import frames as fr
from ema.core.status import AlarmLevel, AlarmState
from ema.log import LogWriter, contents
from ema.monitor import FIRST, Identified

from .state_file import StateFile
from .voice import Voice

MESSAGE_ID = "6c1f4d0e9b5e4f2a8d3c7a5be0f19d42"  # of the journal's lines about alarms
_SAVED_EVERY = 10  # heartbeats, where no alarm changes
logger = logging.getLogger("ema.daemon")


class AlarmDesk:
    """Where alarms are raised and operators' commands taken.

    Parameters
    ----------
    settings : AlarmSettings
    actuators : numbers
    codec : Codec
    voice : Voice
    log : LogWriter
    state : StateFile
    """

    def __init__(
        self,
        settings: AlarmSettings,
        actuators: Iterable[int],
        codec: Codec,
        voice: Voice,
        log: LogWriter,
        state: StateFile,
    ):
        self.alarms = Alarms(settings, actuators)
        self._codec, self._voice, self._log, self._state = codec, voice, log, state
        self._ears = Ears(codec, self.alarms.actuators)
        self._sender = Sender()
        self._n_beats = 0
        self._changed = False
        self._asked: Command | None = None
        self._none = codec.encode(ALARM, 0, alarm_values(None, 0, 0, codec))

    def start(self, t_ns: int) -> None:
        """Go on from the state file."""
        try:
            stored = self._state.load()
            if stored is not None:
                self.alarms.restore(stored)
        except ValueError as error:
            aside = self._state.set_aside()
            logger.warning("%s: %s; alarms begin anew, it is kept as %s", self._state.path, error, aside.name)
        self._say_state(t_ns)

    def retake(self, settings: AlarmSettings, t_ns: int) -> None:
        """Go on with other thresholds: alarms stand as they are, what led to them begins anew."""
        alarms = Alarms(settings, self.alarms.actuators)
        alarms.restore(self.alarms.snapshot())
        self.alarms = alarms
        self._say_state(t_ns)

    def _say_state(self, t_ns: int) -> None:
        settings = self.alarms.settings.model_dump(mode="json")
        self._log.alarm_state({"t_ns": t_ns, "settings": settings, "snapshot": self.alarms.snapshot()})

    def hear(self, frames: np.ndarray) -> list[Heard]:
        """Operators' commands and windings' temperatures among received frames, shape (n,), FRAME_DTYPE."""
        return self._ears.hear(frames)

    def take(self, heard: Heard) -> None:
        """Do what an operator asks, or note a temperature."""
        if not isinstance(heard, Command):
            self._tell(self.alarms.hear(heard))
            return
        asked = heard._replace(t_ns=0)
        if asked != self._asked:  # a command is sent twice
            whose = "monitor" if heard.actuator is None else f"actuator {heard.actuator}"
            logger.info("%s: %s of alarm %s asked for", whose, heard.action.name.lower(), heard.cause)
        self._asked = asked
        self._tell(self.alarms.hear(heard))
        self._save()

    def estimate(self, out: Identified) -> None:
        """Take an estimate; those of the identifier that runs in every cycle are judged."""
        if out.estimate.method == FIRST:
            self._tell(self.alarms.estimate(Judged.of(out)))

    def beat(self, status: dict[str, Any]) -> None:
        """Take what the monitor says of itself, as logged; repeat what stands."""
        t_ns = status["t_ns"]
        self._tell(self.alarms.supervise(t_ns, conditions(status)))
        self._repeat(t_ns)
        self._n_beats += 1
        if self._changed or self._n_beats % _SAVED_EVERY == 0:
            self._save()

    def close(self) -> None:
        """Keep the last state."""
        self._save()

    def _tell(self, changes: list[Change]) -> None:
        for change in changes:
            self._changed = True
            self._send([self._frame(change, self._n_standing(change.actuator))])
            text = said(change)
            self._log.alarm(contents.alarm(change, text))
            loud = change.level == AlarmLevel.ALARM and change.state == AlarmState.ACTIVE
            level = logging.ERROR if loud else logging.WARNING if change.level else logging.INFO
            logger.log(level, "%s", text, extra={"journal": _fields(change)})

    def _repeat(self, t_ns: int) -> None:
        standing = self.alarms.standing(t_ns)
        counts: dict[int | None, int] = {}
        for change in standing:
            counts[change.actuator] = counts.get(change.actuator, 0) + 1
        quiet = [number for number in self.alarms.actuators if number not in counts]
        none = np.repeat(self._none, len(quiet))
        none["t_ns"] = t_ns
        none["id"] = [identifiers.with_actuator(int(self._none["id"][0]), number) for number in quiet]
        self._send([*(self._frame(change, counts[change.actuator]) for change in standing), none])

    def _frame(self, change: Change, n_standing: int) -> np.ndarray:
        number = 0 if change.actuator is None else change.actuator
        return self._codec.encode(
            ALARM, number, alarm_values(change, n_standing, change.t_ns, self._codec), change.t_ns
        )

    def _n_standing(self, actuator: int | None) -> int:
        return sum(change.actuator == actuator for change in self.alarms.standing(0))

    def _send(self, frames: list[np.ndarray]) -> None:
        self._voice.write(self._sender.protect(fr.joined(frames)))

    def _save(self) -> None:
        self._changed = False
        self._state.save(self.alarms.snapshot())


def _fields(change: Change) -> dict[str, object]:
    whose = {} if change.actuator is None else {"EMA_ACTUATOR": change.actuator}
    level, state = change.level.name.lower(), change.state.name.lower()
    return {"MESSAGE_ID": MESSAGE_ID, "EMA_CAUSE": change.cause, "EMA_LEVEL": level, "EMA_STATE": state, **whose}
