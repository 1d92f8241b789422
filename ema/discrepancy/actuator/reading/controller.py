"""Whether the currents follow another controller than the plant file's: said of a rest, named by no effect.

I_ref = K_w K_p (θ_cmd - θ_u) - K_w ω_m    is linear in both, and all of it is in the record: other gains are read from
it. Another law of the position error (one that ignores small errors, or limits large ones) is a rest of the currents
that is a function of that error.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ema.core.records import Array
from ema.models.actuator import Actuator

from .features import (
    GROUPS,
    SETTLING,
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
N_PARTS = 24  # of the errors and speeds that were passed through, as many samples in each
ALIKE = 0.1  # share of a function that a law of one number may leave, and be told for it
MOST = 0.5  # share of what the model leaves of the currents that is worth a sentence as a function of one quantity


def fit_gains(plant: Actuator, signals: Sequence[Signals]) -> tuple[float, float] | None:
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


def describe_gains(plant: Actuator, signals: Sequence[Signals]) -> list[str]:
    """One sentence, where other gains explain the currents far better."""
    found = fit_gains(plant, signals)
    if found is None:
        return []
    return [f"the currents follow a controller with {found[0]:.3g} times the K_p and {found[1]:.3g} times the K_w"]


def fit_function_of_error(plant: Actuator, rests: Sequence[tuple[Signals, Array]]) -> dict[str, Any] | None:
    """What a model leaves of the currents as a function of the position error; None where that is not what they are.

    Error and speed go together along a motion, and a delay or another gain is a function of speed: then it is none.

    Parameters
    ----------
    rests : sequence of (Signals, array of shape (n_nodes,))
        Cycles with what is left of their balance of control. [A]

    Returns
    -------
    function : dict or None
        ``at``, position errors [rad]; ``current`` there [A]; ``share`` of the rest; ``gain``, the plant file's [A/rad].
    """
    lag = current_lag(plant) + 0.5
    errors, speeds, left = [], [], []
    for s, rest in rests:
        m = spacing(GROUPS["control"][0], plant.control.rate, s.theta_m.shape[1])
        by_error, by_speed = local_mean(delayed(reference_terms(plant, s)[:, 0], lag), m)
        settled = slice(round(SETTLING * plant.control.rate) // m, None)
        free = np.abs(by_error + by_speed)[settled] < FREE * plant.inverter.I_max
        errors.append(by_error[settled][free])
        speeds.append(by_speed[settled][free])
        left.append(rest[free])
    r = np.concatenate(left)
    if len(r) < FEWEST or not r.any():
        return None
    gain = plant.control.K_w * plant.control.K_p
    at, current, share = _function(np.concatenate(errors) / gain, r)
    if share < MOST or 1.0 - share > CLEAR * (1.0 - _function(np.concatenate(speeds), r)[2]):
        return None
    return {"at": at.tolist(), "current": current.tolist(), "share": round(share, 3), "gain": gain}


def _function(of: Array, r: Array) -> tuple[Array, Array, float]:
    """Mean of r over parts of a quantity: middles of the parts, means, and the share of Σ r² that they explain."""
    part = np.digitize(of, np.quantile(of, np.linspace(0.0, 1.0, N_PARTS + 1))[1:-1])
    n = np.maximum(np.bincount(part, minlength=N_PARTS), 1)
    middle, mean = (np.bincount(part, x, N_PARTS) / n for x in (of, r))
    return middle, mean, 1.0 - float(((r - mean[part]) ** 2).sum()) / float(r @ r)


def describe_function_of_error(found: dict[str, Any]) -> list[str]:
    """One sentence on what `of_error` found."""
    current = found["current"]
    return [
        f"the controller asks for other currents than the plant file's, between {min(current):+.2g} and "
        f"{max(current):+.2g} A as a function of the position error ({found['share']:.0%} of what is left of them)"
        + _as_if(np.array(found["at"]), np.array(current), found["gain"])
    ]


def _as_if(at: Array, current: Array, gain: float) -> str:
    """The law of one number that a function of the position error is, in words; nothing where it is neither."""
    sizes = float(np.abs(at).max()) * np.geomspace(1e-3, 1.0, 300)[:-1, None]
    within = gain * np.clip(at, -sizes, sizes)
    laws = {"below {:.2g} rad were ignored": -within, "were cut off at {:.2g} rad": within - gain * at}
    lost = {law: ((current - of) ** 2).sum(axis=1) for law, of in laws.items()}
    law = min(lost, key=lambda of: float(lost[of].min()))
    best = int(np.argmin(lost[law]))
    is_alike = lost[law][best] < ALIKE * float(current @ current)
    return f", as if errors {law.format(float(sizes[best, 0]))}" if is_alike else ""
