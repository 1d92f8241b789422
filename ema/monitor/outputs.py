"""What the monitor answers: estimates, envelopes, events, and work for slower identifiers."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ema.core.status import Reason
from ema.identification import Estimate, Measurement

FIRST = "linear"  # the identifier of every cycle


class Level(StrEnum):
    """How serious an event is."""

    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


class LostJob(StrEnum):
    """Codes of events that say a job was not done; their text begins with the method."""

    SKIPPED = "job_skipped"
    FAILED = "job_failed"


@dataclass(frozen=True)
class Event:
    """Something a person may want to know. `actuator` is None where it concerns all."""

    t_ns: int
    level: Level
    code: str
    text: str
    actuator: int | None = None


@dataclass(frozen=True)
class Job:
    """A cycle for an identifier: what it needs, and what went wrong on the bus."""

    t_ns: int
    actuator: int
    cycle: int
    method: str
    measurement: Measurement
    reasons: Reason


@dataclass(frozen=True)
class Identified:
    """An estimate of one cycle, its status and reasons joined with those of the bus and of the model check.

    `t_ns` is the time of the frame that closed the cycle. [ns]
    """

    t_ns: int
    actuator: int
    cycle: int
    estimate: Estimate


@dataclass(frozen=True)
class SampledEnvelope:
    """Envelope of one cycle at the schedule.

    Attributes
    ----------
    t : array, shape (n_omega,)
        Since the start of the cycle. [s]
    measured, model, sd : arrays, shape (n_omega,)
        Measured envelope, that of the linear model at its estimate, and the standard deviation of their difference;
        NaN where there is none. [A]
    """

    t_ns: int
    actuator: int
    cycle: int
    t: np.ndarray
    measured: np.ndarray
    model: np.ndarray
    sd: np.ndarray


Output = Event | Job | Identified | SampledEnvelope
