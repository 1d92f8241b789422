"""How well a recorded bus voltage is known: by what repetitions of a motion differ by, not by a constant."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ema.discrepancy.actuator.reading.supply import DOUBT, LIKE, resolve

AT = [slice(2, 50)]


def record(n: int, scatter: float, swing: float, quantum: float = 0.0):
    """So many cycles of one motion, with averages of the voltage at AT."""
    rng = np.random.default_rng(4)
    course = swing * np.sqrt(2.0) * np.sin(np.arange(48) / 48.0 * 2.0 * np.pi)
    y = [np.concatenate([[1e3, 1e3], course + scatter * rng.standard_normal(48)]) for _ in range(n)]
    u_dc = 48.0 + rng.standard_normal((1, 500))
    u_dc = quantum * np.round(u_dc / quantum) if quantum else u_dc
    return SimpleNamespace(y=y, motion=np.zeros(n, int), signals=[SimpleNamespace(u_dc=u_dc)])


def test_a_voltage_is_known_as_well_as_repetitions_agree():
    assert resolve(record(6, 1e-3, 0.0), AT) == pytest.approx(DOUBT * 1e-3, rel=0.2)
    assert resolve(record(6, 1e-6, 0.5), AT) == pytest.approx(LIKE * 0.5, rel=0.01)


def test_a_coarse_converter_hides_what_repetitions_have_alike():
    assert resolve(record(6, 1e-6, 0.0, quantum=0.1), AT) == pytest.approx(0.1 / np.sqrt(12.0), rel=0.01)


@pytest.mark.parametrize("cycles", [record(1, 1e-3, 0.1), record(4, 0.0, 0.0)], ids=["once", "constant"])
def test_where_no_repetition_tells_nothing_is_told(cycles):
    assert resolve(cycles, AT) is None
