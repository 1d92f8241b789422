"""A drive that is sampled too slowly is refused, and none that is not."""

from __future__ import annotations

import numpy as np
import pytest

from ema.core.errors import RecordError
from ema.core.records import Cycle, Record
from ema.discrepancy.axis.reading.undersampled import refuse_undersampled
from ema.models.axis_config import RotaryAxis

PLANT = RotaryAxis(J=1e-4, F_d=0.0, k_t=0.05, k_e=0.05, R=1.0, L=1e-3, drive="voltage")
T = np.arange(0.0, 2.0, 1e-3)


def record(u: np.ndarray, between: np.ndarray) -> Record:
    """A first-order motor at `u`, which the record shows, and at `between` on the way from one sample to the next."""
    w = np.zeros(len(T))
    for n in range(1, len(T)):
        w[n] = w[n - 1] + 25.0 * 1e-3 * (between[n - 1] / 0.05 - w[n - 1])
    return Record((Cycle(0, {"t": T, "u_q": u, "w_m": w}),))


def test_what_changes_between_samples_is_refused():
    rng = np.random.default_rng(3)
    shown, acted = rng.standard_normal((2, len(T)))
    with pytest.raises(RecordError, match=r"u_q changes faster than a sample in 0\.001 s can show"):
        refuse_undersampled(PLANT, record(shown, acted))


def test_a_drive_as_white_that_foretells_the_motion_is_taken():
    held = np.random.default_rng(3).standard_normal(len(T))
    refuse_undersampled(PLANT, record(held, held))


def test_a_slow_drive_is_taken():
    slow = np.sin(2.0 * np.pi * 3.0 * T)
    refuse_undersampled(PLANT, record(slow, slow))


def test_a_drive_that_never_changes_while_the_axis_moves_is_refused():
    with pytest.raises(RecordError, match="stays the same but for 0 samples"):
        refuse_undersampled(PLANT, record(np.zeros(len(T)), np.random.default_rng(4).standard_normal(len(T))))
