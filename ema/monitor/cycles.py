"""What a test cycle is on the bus, and what the assembly makes of one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ema.core.status import Reason

SAMPLES_PER_FRAME = 10
MOTION_RATIO = 10  # current samples to one motion sample


class Span(NamedTuple):
    """What CycleStart and CycleEnd say: which frames are the cycle's."""

    cycle: int
    first_current: int
    first_motion: int
    n_samples: int
    period: float
    motion_kind: int

    @property
    def n_currents(self) -> int:
        """Frames of PhaseCurrents in the cycle."""
        return -(-self.n_samples // SAMPLES_PER_FRAME)

    @property
    def n_motion_samples(self) -> int:
        """Samples of position and command in the cycle."""
        return -(-self.n_samples // MOTION_RATIO)

    @property
    def n_motions(self) -> int:
        """Frames of Motion in the cycle."""
        return -(-self.n_motion_samples // SAMPLES_PER_FRAME)

    @property
    def last_current(self) -> int:
        """Sequence number of the last frame of PhaseCurrents, not yet wrapped."""
        return self.first_current + self.n_currents - 1


class Tally(NamedTuple):
    """What happened to a cycle's frames of PhaseCurrents; refused are those of any message of the actuator."""

    n_lost: int = 0
    n_reordered: int = 0
    n_repeated: int = 0
    n_corrupt: int = 0  # CRC, length or counter wrong
    n_refused: int = 0  # not authentic


@dataclass(frozen=True)
class AssembledCycle:
    """One cycle as it was received.

    Attributes
    ----------
    t_ns : int
        Time of the frame that closed the cycle. [ns]
    i : array, shape (3, n_samples)
        Phase currents; zero where missing. [A]
    missing : array of bool, shape (n_samples,)
    motion : dict of arrays, shape (n_motion_samples,)
        theta_u, theta_m (within one turn), theta_cmd at a tenth of the rate; NaN where missing. [rad]
    reasons : Reason
        What went wrong on the bus.
    """

    t_ns: int
    actuator: int
    span: Span
    i: np.ndarray
    missing: np.ndarray
    motion: dict[str, np.ndarray]
    tally: Tally
    reasons: Reason
