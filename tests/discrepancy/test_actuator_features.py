"""The balances: what they must be, whatever the simulator."""

from __future__ import annotations

import numpy as np

from ema.core.records import Cycle, Record
from ema.discrepancy.actuator import features as f
from ema.discrepancy.actuator.cycles import measured
from ema.models import hf


def test_acceleration_and_local_mean_agree_on_a_polynomial():
    t = np.arange(1001) * 1e-4
    theta = 3.0 * t**3
    m = 10
    inside = f.acceleration(theta, m, 1e-4)
    np.testing.assert_allclose(inside, f.local_mean(18.0 * t, m), rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(f.nodes(t, m), f.local_mean(t, m), rtol=1e-12)


def test_delayed_shifts_by_a_fraction():
    x = np.arange(50.0)
    np.testing.assert_allclose(f.delayed(x, 1.59)[5:], x[5:] - 1.59)
    assert f.delayed(x, 1.59)[0] == 0.0


def test_two_implementations_agree_within_noise(hidden, shipped_plant):
    """The project's model and an independent one give the same features but for switching noise."""
    n = 24
    runs = hf.simulate(shipped_plant, np.zeros((n, 6)), seeds=np.arange(n))
    command = shipped_plant.command()
    ours = f.stacked(
        f.features(
            shipped_plant,
            f.Signals(runs.i, runs.theta_m, runs.theta_u, np.broadcast_to(command, runs.theta_m.shape), runs.u_dc),
        )
    )
    flawless = hidden.Flaws()
    theirs = np.array(
        [
            measured(shipped_plant, [Record((Cycle(0, hidden.cycle(flawless, command, hidden.rest(), seed)),))]).y[0]
            for seed in range(6)
        ]
    )
    floor = f.floors(f.features(shipped_plant, f.Signals(runs.i[:1], runs.theta_m[:1], runs.theta_u[:1],
                                                         command[None], runs.u_dc[:1])))  # fmt: skip
    sd = np.sqrt(ours.var(axis=0, ddof=1) + floor**2)
    z = (theirs.mean(axis=0) - ours.mean(axis=0)) / (sd * np.sqrt(1 / 6 + 1 / n))
    assert np.mean(z**2) < 1.5
