"""Whether the currents follow a controller with other gains than the plant file's: said of a rest, named by no effect.

I_ref = K_w K_p (θ_cmd - θ_u) - K_w ω_m    is linear in both, and all of it is in the record.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ema.models.actuator import Actuator

from .features import (
    GROUPS,
    Signals,
    current_lag,
    dc_current,
    delayed,
    local_mean,
    motor_torque,
    reference_terms,
    spacing,
)

FREE = 0.9  # share of I_max up to which a reference is taken as not limited
FEWEST = 30  # nodes
CLEAR = 0.3  # share of what the plant file's gains leave of the current, below which others are worth a sentence
OTHER = 0.03  # by which a gain must differ


def gains(plant: Actuator, signals: Sequence[Signals]) -> tuple[float, float] | None:
    """K_p and K_w over the plant file's by which the currents follow; None where that makes little difference."""
    lag = current_lag(plant) + 0.5
    A, y = [], []
    for s in signals:
        m = spacing(GROUPS["control"][0], plant.control.rate, s.theta_m.shape[1])
        i_q = dc_current(motor_torque(plant, s)[1], s.i)
        terms = reference_terms(plant, s)[:, 0]
        free = (np.abs(terms.sum(axis=0)) < FREE * plant.inverter.I_max).astype(float)
        inside = local_mean(delayed(free, lag), m) > 1.0 - 1e-9
        A.append(local_mean(delayed(terms, lag), m)[:, inside])
        y.append(local_mean(i_q[0], m)[inside])
    X, i = np.concatenate(A, axis=1).T, np.concatenate(y)
    if len(i) < FEWEST:
        return None
    (both, K_w), *_ = np.linalg.lstsq(X, i, rcond=None)
    left, left_now = (float(((i - X @ x) ** 2).sum()) for x in (np.array([both, K_w]), np.ones(2)))
    if K_w <= 0.0 or both <= 0.0 or left > CLEAR * left_now or max(abs(both / K_w - 1.0), abs(K_w - 1.0)) < OTHER:
        return None
    return float(both / K_w), float(K_w)


def said(plant: Actuator, signals: Sequence[Signals]) -> list[str]:
    """One sentence, where other gains explain the currents far better."""
    found = gains(plant, signals)
    if found is None:
        return []
    return [f"the currents follow a controller with {found[0]:.3g} times the K_p and {found[1]:.3g} times the K_w"]
