"""Online check of the model: do residuals stay within what its noise explains, and faults within what can be?"""

from __future__ import annotations

from collections import deque

import numpy as np

from ema.identification import Unbounded
from ema.identification.unbounded import p_possible

from .settings import ModelCheck


class ModelDoubt:
    """Judges one identifier's estimates of consecutive cycles.

    A cycle speaks against the model by its residual, or when with it the mean of the last cycles is `impossible`: less
    than no fault, or more than a complete failure. One unlikely cycle is no reason to doubt a model, several of the
    last few are. Once in doubt, the model stays so until none of the last cycles speaks against it.
    """

    def __init__(self, settings: ModelCheck):
        self._settings = settings
        self._cycles: deque[tuple[int, bool, bool]] = deque(maxlen=settings.cycles)  # number, fits, is possible
        self._unbounded: deque[Unbounded] = deque(maxlen=settings.cycles)
        self.doubted = self.impossible = False

    def update(self, cycle: int, p_value: float, unbounded: Unbounded | None = None) -> bool:
        """Take the p-value of a cycle's residual (NaN: nothing known) and the estimate; has the judgement changed?"""
        if np.isnan(p_value):
            return False
        if unbounded is not None:
            self._unbounded.append(unbounded)
            self.impossible = p_possible(self._unbounded) < self._settings.level
        self._cycles.append((cycle, p_value >= self._settings.level, not self.impossible))
        before = self.doubted
        n_against = len(self.cycles)
        if n_against >= self._settings.failures:
            self.doubted = True
        elif n_against == 0 and len(self._cycles) == self._settings.cycles:
            self.doubted = False
        return self.doubted != before

    @property
    def cycles(self) -> list[int]:
        """Those of the last cycles that speak against the model."""
        return [cycle for cycle, fits, possible in self._cycles if not (fits and possible)]

    @property
    def fits(self) -> bool:
        """Whether some of those fit by their residual."""
        return any(fits and not possible for _, fits, possible in self._cycles)
