"""What the assembly makes of a test cycle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ema.bus.span import Span
from ema.core.status import Reason


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
