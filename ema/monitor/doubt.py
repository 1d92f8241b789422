"""Online check of the model: do the residuals stay within what its noise explains?"""

from __future__ import annotations

from collections import deque

import numpy as np

from .settings import ModelCheck


class ModelDoubt:
    """Judges one identifier's residuals of consecutive cycles.

    One unlikely cycle is no reason to doubt a model, several of the last few are. Once in doubt, the model stays so
    until none of the last cycles speaks against it.
    """

    def __init__(self, settings: ModelCheck):
        self._settings = settings
        self._against: deque[tuple[int, bool]] = deque(maxlen=settings.cycles)
        self.doubted = False

    def update(self, cycle: int, p_value: float) -> bool:
        """Take the p-value of a cycle's residual (NaN: nothing known); whether the judgement has changed."""
        if np.isnan(p_value):
            return False
        self._against.append((cycle, p_value < self._settings.level))
        before = self.doubted
        n_against = len(self.cycles)
        if n_against >= self._settings.failures:
            self.doubted = True
        elif n_against == 0 and len(self._against) == self._settings.cycles:
            self.doubted = False
        return self.doubted != before

    @property
    def cycles(self) -> list[int]:
        """Those of the last cycles that speak against the model."""
        return [cycle for cycle, against in self._against if against]
