"""From a start to the least misfit: Gauss–Newton with columns along singular directions and steps along parabolas.

Columns of causes that look alike are nearly parallel, and what simulations scatter drowns their difference. A column is
therefore not taken along a parameter but along a singular direction of those known so far, and as long as is clearly
felt, so that each has one and the same share of noise; and to both sides, so that a bent valley does not bend it.
A step bends with the response, as far as what it first led to differs from what columns promised (geodesic
acceleration, Transtrum and Sethna, arXiv:1201.5885): so bent valleys are followed. Every step is simulated before it is
taken.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from .hypothesis import Array

FELT = 60.0  # [σ] length of the response to a step along a direction: columns are then known to a few per cent
TURNS = 12  # of columns and steps
ENOUGH = 0.05  # squared length that a step must promise to be worth its simulation, for each parameter [σ²]
SHRUNK, GROWN = 0.25, 2.0  # of the trust radius, after a step that failed or did as it promised
KEPT = 0.25  # share of the promised gain from which a step is trusted
SHARES = (2.0, 1.0, 0.5, 0.2)  # of a step, that are simulated at once

Residuals = Callable[[Array], Array]  # points (n, p) to whitened residuals (n, m): measured less simulated
Responses = Callable[[Array, Array], Array]  # a point (p,) and points (n, p) to how simulated ones differ, (n, m)


@dataclass(frozen=True)
class Fit:
    """Where a fit ended.

    Attributes
    ----------
    x : array, shape (p,)
    columns : array, shape (m, p)
        ∂(simulated)/∂x there, per unit.
    residual : array, shape (m,)
    cost : float
        Its squared length.
    """

    x: Array
    columns: Array
    residual: Array
    cost: float


def fit(
    residuals: Residuals,
    start: Array,
    low: Array,
    high: Array,
    steps: Array,
    turns: int = TURNS,
    columns: Array | None = None,
    responses: Responses | None = None,
) -> Fit:
    """Bounded least squares from one start.

    Parameters
    ----------
    residuals : callable
        Deterministic (common random numbers), so that costs can be compared.
    steps : array, shape (p,)
        Changes that are clearly felt, by which the first columns are taken; they set the scale of each parameter.
    columns : array, shape (m, p), optional
        Known roughly: they tell the first directions, and spare the columns along parameters.
    responses : callable, optional
        How simulated points differ, where that costs less than `residuals` of each.
    """
    respond = responses or (lambda at, points: residuals(at[None]) - residuals(points))
    x = np.clip(start, low, high)
    V = np.diag(np.abs(steps))
    r = residuals(x[None])[0]
    J = columns_along(respond, x, V, low, high) if columns is None else columns
    V = _singular(J, V)
    J = columns_along(respond, x, V, low, high)
    cost, radius = float(r @ r), np.inf
    for _ in range(turns):
        step, promised = bounded_step(J, r, x, low, high, V, radius)
        if cost - promised < ENOUGH * len(x):
            break
        ahead = residuals(np.clip(x + step, low, high)[None])[0]
        bend, _ = bounded_step(J, ahead - (r - J @ step), x + step, low, high, V, np.inf)
        share = np.array(SHARES)[:, None]
        tried = np.clip(np.concatenate([x + share * step + share**2 * bend, x[None] + step]), low, high)
        left = residuals(tried)
        costs = (left**2).sum(axis=1)
        best = int(np.argmin(costs))
        gain = cost - costs[best]
        if gain > KEPT * (cost - promised):
            radius *= GROWN
        else:
            radius = SHRUNK * min(radius, _scaled(step, V))
        if gain > 0.0:
            x, r, cost = tried[best], left[best], float(costs[best])
        V = _singular(J, V)
        J = columns_along(respond, x, V, low, high)
    return Fit(x, J, r, cost)


def best_of(
    residuals: Residuals,
    starts: Sequence[Array],
    low: Array,
    high: Array,
    steps: Array,
    turns: int = TURNS,
    columns: Array | None = None,
    responses: Responses | None = None,
) -> list[Fit]:
    """Fits from several starts, best first; those that ended where a better one did are left out."""
    found = sorted(
        (fit(residuals, s, low, high, steps, turns, columns, responses) for s in starts), key=lambda f: f.cost
    )
    kept: list[Fit] = []
    for f in found:
        if all(float(((g.columns @ (f.x - g.x)) ** 2).sum()) > len(f.x) for g in kept):
            kept.append(f)
    return kept


def columns_along(respond: Responses, x: Array, V: Array, low: Array, high: Array) -> Array:
    """Columns per unit of each parameter, from steps along the columns of V (p, p) to both sides within bounds."""
    ahead, back = (np.clip(x[:, None] + sign * V, low[:, None], high[:, None]).T for sign in (1.0, -1.0))
    response = respond(x, np.concatenate([ahead, back]))
    p = V.shape[1]
    J, *_ = np.linalg.lstsq(ahead - back, response[:p] - response[p:], rcond=1e-9)
    return np.asarray(J.T)


def _singular(J: Array, V: Array) -> Array:
    """Singular directions of J, each as long as is clearly felt, but no longer than 4 times what V spans."""
    scale = np.linalg.norm(V, axis=1)
    _, s, Wt = np.linalg.svd(J * scale, full_matrices=False)
    length = np.minimum(0.5 * FELT / np.maximum(s, 1e-300), 4.0)
    return np.asarray(scale[:, None] * Wt.T * length)


def _scaled(step: Array, V: Array) -> float:
    return float(np.abs(step / np.linalg.norm(V, axis=1)).max())


def bounded_step(J: Array, r: Array, x: Array, low: Array, high: Array, V: Array, radius: float) -> tuple[Array, float]:
    """The step within bounds and trust radius that leaves least to first order, and the cost it promises."""
    scale = np.linalg.norm(V, axis=1)
    reach = radius * scale if np.isfinite(radius) else np.full(len(x), np.inf)
    below, above = np.maximum(low - x, -reach), np.minimum(high - x, reach)
    margin = 1e-12 * (1.0 + np.abs(x)) + 1e-12 * scale
    solved = lsq_linear(J * scale, r, ((below - margin) / scale, (above + margin) / scale), method="bvls")
    return np.clip(solved.x * scale, below, above), 2.0 * float(solved.cost)
