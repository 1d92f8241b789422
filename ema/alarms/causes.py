"""What an alarm may be about."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

from ema.core.names import FAULT_MEANING, FAULTS


class Kind(StrEnum):
    """What is judged."""

    FAULT = "fault"  # size of a fault
    RATE = "rate"  # how fast it grows
    LIFE = "life"  # when it will pass its alarm level
    ESTIMATE = "estimate"  # whether there are estimates, and whether the model they are made with holds
    SUPERVISION = "supervision"  # whether the monitor itself is well


class Cause(NamedTuple):
    """One cause; its number on the bus is in the DBC."""

    name: str
    kind: Kind
    meaning: str
    fault: str = ""
    unit: str = "1"  # of what is judged


def _of_faults() -> list[Cause]:
    made = [Cause(k, Kind.FAULT, FAULT_MEANING[k], k) for k in FAULTS]
    made += [Cause(f"{k}_rate", Kind.RATE, f"{FAULT_MEANING[k]} grows fast", k, "1/h") for k in FAULTS]
    made += [Cause(f"{k}_life", Kind.LIFE, f"{FAULT_MEANING[k]} soon at its alarm level", k, "h") for k in FAULTS]
    return made


MODEL = Cause("model_in_doubt", Kind.ESTIMATE, "the model does not explain the currents")
BLIND = Cause("no_estimate", Kind.ESTIMATE, "no usable estimate")
SILENT = Cause("silent", Kind.SUPERVISION, "it, or some of its frames, is not heard")
CHANNEL = Cause("channel", Kind.SUPERVISION, "a channel reads what the actuator cannot do")
SECOND = Cause("second_monitor", Kind.SUPERVISION, "another monitor estimates it")
LOG = Cause("log", Kind.SUPERVISION, "the log is not written")
BEHIND = Cause("behind", Kind.SUPERVISION, "identifiers do not follow, or fail")
BUS = Cause("bus", Kind.SUPERVISION, "the bus is down or disturbed, or frames are lost")
OF_ACTUATOR = (MODEL, BLIND, SILENT, CHANNEL, SECOND)
OF_MONITOR = (LOG, BEHIND, BUS)
CAUSES = {cause.name: cause for cause in (*_of_faults(), *OF_ACTUATOR, *OF_MONITOR)}
