"""What a test cycle is on the bus: which frames carry it, and how many."""

from __future__ import annotations

from typing import NamedTuple

SAMPLES_PER_FRAME = 10  # as the DBC lays them out
MOTION_RATIO = 10  # current samples to one motion sample


N_CYCLES = 1 << 32  # after so many, cycles are numbered from 0 again


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
