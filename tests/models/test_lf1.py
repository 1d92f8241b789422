"""LF1 by physics, and its likeness to HF."""

from __future__ import annotations

import numpy as np

from ema.models import hf, lf1


def rms(x):
    return np.sqrt(np.mean(x**2))


def test_the_nominal_envelope_is_that_of_hf(shipped_plant):
    i_hf = hf.simulate(shipped_plant, np.zeros((16, 6)), seeds=np.arange(16)).envelope.mean(axis=0)
    assert rms(lf1.simulate(shipped_plant, np.zeros((1, 6)))[0] - i_hf) < 0.03 * rms(i_hf)


def test_every_fault_changes_it_as_it_changes_hf(shipped_plant):
    k = np.vstack([np.zeros(6), 0.1 * np.eye(6)])
    i_hf = hf.simulate(shipped_plant, np.repeat(k, 16, axis=0), seeds=np.arange(112)).envelope
    d_hf = np.diff(i_hf.reshape(7, 16, -1).mean(axis=1)[[0, 1, 0, 2, 0, 3, 0, 4, 0, 5, 0, 6]], axis=0)[::2]
    i = lf1.simulate(shipped_plant, k)
    for fault, (own, other) in enumerate(zip(i[1:] - i[0], d_hf, strict=True)):
        assert own @ other / np.linalg.norm(own) / np.linalg.norm(other) > 0.9, f"k{fault + 1}"
        assert 0.8 < np.linalg.norm(own) / np.linalg.norm(other) < 1.25, f"k{fault + 1}"


def test_a_run_does_not_depend_on_its_place_in_the_batch(shipped_plant):
    k = np.random.default_rng(1).uniform(0, 0.3, (20, 6))
    assert np.allclose(lf1.simulate(shipped_plant, k)[17], lf1.simulate(shipped_plant, k[17:18])[0], atol=1e-9)


def test_weaker_torque_asks_for_more_current(shipped_plant):
    i = [lf1.simulate(shipped_plant, np.zeros((1, 6)), lf1.Tuning(torque=f))[0] for f in (0.8, 1.0, 1.25)]
    assert i[0].mean() > i[1].mean() > i[2].mean()
