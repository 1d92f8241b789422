"""One cycle as it was: a change of the equations shows here first. Made by `tools/golden_record.py`."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]


def test_the_golden_cycle():
    """To the switching noise of two runs: another processor rounds otherwise, and switching decorrelates."""
    tool = runpy.run_path(str(ROOT / "tools" / "golden_record.py"))
    golden = np.loadtxt(tool["PATH"], delimiter=",", skiprows=1)
    now = tool["record"]()
    difference = now - golden
    rms = np.sqrt(np.mean(difference**2, axis=0))
    assert rms[0] < 1e-6
    assert rms[1] < 2 * 0.0085  # [A]
    assert rms[2] < 1.5e-5  # [rad] one step of the LVDT
    assert rms[3] < 500 * 1.5e-5  # [rad]
