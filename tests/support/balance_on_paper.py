"""Rows of the balance of torque on a motion that is known on paper: no simulation, no noise but what is added."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array

from ema.discrepancy.axis.balance.laws.law import Acting
from ema.discrepancy.axis.balance.laws.motion import Motion
from ema.discrepancy.axis.balance.regressing.regression import Plain
from ema.discrepancy.axis.balance.regressing.rows import Rows

J, F_D, C = 2e-3, 0.05, 4e-3
PLAIN = Plain(J, F_D, C)
N, T_S = 6000, 1e-3


def motion(**other) -> Motion:
    """Two sines, with a neighbour that moves by a third; the drive gives what inertia, friction and drag need."""
    t = T_S * np.arange(N)
    parts = ((2.5, 2.1, 0.3), (0.7, 9.0, 1.1))
    theta, w, a = (sum(x) for x in zip(*(_sine(t, *p) for p in parts), strict=True))
    friction = F_D * np.sign(w) + C * w
    made = Motion(t, theta, w, a, J * a + friction, J * a, np.sign(w), True, np.zeros(N, bool))
    first = np.repeat((0, 1), N // 2)
    of = {"other": _sine(t, 1.2, 5.3, 0.0), "neighbour": "outer", "dT": np.linspace(0.0, 40.0, N)}
    return replace(made, record=first, records=("one", "two"), gear_orders=(7.3,), **{**of, **other})


def _sine(t, A, w, phase):
    return A * np.sin(w * t + phase), A * w * np.cos(w * t + phase), -A * w**2 * np.sin(w * t + phase)


def rows(m: Motion, torque=0.0, noise=0.0, seed=0) -> Rows:
    """Means over ten samples, in forty blocks, of a balance in which a further torque opposes the motion."""
    n = N // 10
    mean = csr_array((np.full(N, 0.1), (np.arange(N) // 10, np.arange(N))), shape=(n, N))
    m = replace(m, drive=m.drive + torque, known=m.known + torque)
    y = mean @ m.known + noise * np.random.default_rng(seed).standard_normal(n)
    block = np.arange(n) * 40 // n
    record = np.arange(n) * 2 // n
    return Rows(
        m, y, mean @ m.drive, mean @ m.a, mean, mean * 0.0, block, np.ones(n, bool), block, record, np.ones(n), 0.01
    )


def acting(m: Motion) -> Acting:
    return Acting(m.drive, m.drive - F_D * m.direction, 0.5 * m.drive)
