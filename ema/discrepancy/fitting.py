"""Bounded least squares of free parameters on some blocks of a plant.

Where a recorded drive with noise drives the plant, parameters that take less of it (a larger inertia, a lag) leave
a smaller residual. So the squares of what a further draw of that noise adds to the residual (`Plant.noisier`) count
against its own: least squares with errors in the regressors, see `docs/decisions/0020-noise-in-the-fit.md`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from . import blocks_left_out as left_out

if TYPE_CHECKING:
    from ema.core.records import Array

    from .plant import Free, Plant, Point

HUBER = 4.0  # residuals beyond this many scales count linearly: a window that diverges must not decide a fit
WILD = 20.0  # and beyond this many they all count the same when models are compared
RUNAWAY = 1e4
LONGEST = 30.0  # scales of a parameter in one step
N_DAMPINGS = 6  # tried before a fit gives up
LEAST = 1e-6  # of the largest eigenvalue, below which a direction rests on one block alone
MOVED = 0.3  # deviations of a parameter by which noise must move it to be followed in each iteration
KNOWN_TO = 1.0 / 3.0  # relative deviation of the power of the drive's noise
MOST_NOISE = (
    0.9  # of what the residual shows of a direction, in a step: were it all noise, the step would have no length
)
CONVERGED = 0.02  # gain in log-likelihood of a step below which a fit has converged


@dataclass(frozen=True)
class Fit:
    """A fitted model.

    Attributes
    ----------
    free : tuple of Free
    point : Point
        Values of free and fixed parameters.
    residuals : list of arrays
        Whitened residuals by block.
    more : list of arrays
        What a further draw of the drive's noise adds to them; empty where the plant knows of none.
    covariance : array, shape (n_free, n_free)
        Of the free parameters; scaled by the residual where that is larger than noise, and as wide as blocks disagree.
    blocks : tuple of int
    scale : float
        Robust scale of the residual, at least 1 (= noise).
    by_noise : array, shape (n_free, n_free)
        What the covariance would be were noise all that is left.
    """

    free: tuple[Free, ...]
    point: Point
    residuals: list[Array]
    covariance: Array
    blocks: tuple[int, ...]
    scale: float
    by_noise: Array
    more: list[Array] = field(default_factory=list)

    def draw(self, n: int, seed: int = 0) -> list[Point]:
        """Points drawn from the fit's uncertainty, clipped to the bounds."""
        rng = np.random.default_rng(seed)
        names = [f.name for f in self.free]
        mean = np.array([self.point[name] for name in names])
        # rounding may leave an eigenvalue of a flat direction just below zero
        values = rng.multivariate_normal(mean, self.covariance, size=n, method="eigh", check_valid="ignore")
        values = np.clip(values, [f.low for f in self.free], [f.high for f in self.free])
        return [{**self.point, **dict(zip(names, row.tolist(), strict=True))} for row in values]


def scale_of(residuals: Sequence[Array]) -> float:
    """Robust scale of whitened residuals, at least 1."""
    r = np.concatenate([block.ravel() for block in residuals])
    r = r[np.isfinite(r)]
    rough = max(1.0, 1.4826 * float(np.median(np.abs(r))) if r.size else 1.0)
    kept = r[np.abs(r) < HUBER * rough]
    return max(1.0, float(np.sqrt(np.mean(kept**2))) if kept.size else 1.0)


def log_likelihood(residuals: Sequence[Array], scale: float) -> list[Array]:
    """Log-likelihood per sample (summed over channels) of each block, up to a constant: Huber's at `scale`, bounded."""
    out = []
    for block in residuals:
        u = np.minimum(np.abs(block) / scale, WILD)
        v = np.minimum(u, HUBER)
        out.append(-(v * (u - 0.5 * v)).sum(axis=0))  # u²/2, from HUBER on along the tangent
    return out


def rate(
    runs: Sequence[Sequence[Array]], more: Sequence[Sequence[Array]] = (), scale: float | None = None
) -> list[float]:
    """Log-likelihood of several residuals of the same blocks, all at one scale: the smallest of theirs if not given.

    `more` is what a further draw of the drive's noise adds to each (`add_by_noise`).
    """
    scale = min(scale_of(r) for r in runs) if scale is None else scale
    rates = [float(sum(s.sum() for s in log_likelihood(r, scale))) for r in runs]
    back = [float(sum(s.sum() for s in given_back(d, scale))) for d in more]
    return [own + its for own, its in zip(rates, back, strict=True)] if back else rates


def given_back(more: Sequence[Array], scale: float) -> list[Array]:
    """Half the squares that noise of the drive makes of a residual, per sample of each block, at its scale. [nats]"""
    return [0.5 * np.sum(d**2, axis=0) / scale**2 for d in more]


def add_by_noise(plant: Plant, point: Point, blocks: Sequence[int], residuals: Sequence[Array]) -> list[Array]:
    """What a further draw of the drive's noise adds to the `residuals` at a point; empty where it shows no noise."""
    if plant.noisier is None:
        return []
    again = plant.noisier.residuals([point], blocks)[0]
    return [np.clip(b - a, -HUBER, HUBER) for a, b in zip(residuals, again, strict=True)]


def flatten(residuals: Sequence[Array]) -> Array:
    """Residuals of all blocks, one after the other, shape (n_rows,)."""
    return np.concatenate([block.ravel() for block in residuals])


def jacobian(
    plant: Plant, free: Sequence[Free], point: Point, blocks: Sequence[int], here: Array | None = None
) -> Array:
    """Differences of the residual, shape (n_residuals, n_free), into the side with more room to its bound."""
    points: list[Point] = [] if here is not None else [point]
    steps = []
    for f in free:
        x = point[f.name]
        step = f.difference if f.high - x >= f.difference else -f.difference
        points.append({**point, f.name: x + step})
        steps.append(step)
    if not points:
        return np.empty((0 if here is None else len(here), 0))
    runs = [flatten(r) for r in plant.residuals(points, blocks)]
    here = here if here is not None else runs.pop(0)
    return np.stack([(run - here) / step for run, step in zip(runs, steps, strict=True)], axis=1)


def slopes(
    plant: Plant,
    free: Sequence[Free],
    point: Point,
    blocks: Sequence[int],
    rows: Array,
    moved: NDArray[np.bool_] | None = None,
) -> Array:
    """Of the residual, and below it of what noise of the drive adds to it (`add_by_noise`), by `free`.

    Shape (n_rows, n_free); `rows` are both at the point. What noise adds has no slope by those that it has not `moved`.
    """
    if plant.noisier is None:
        return jacobian(plant, free, point, blocks, rows)
    here, more = np.split(rows, 2)
    own = jacobian(plant, free, point, blocks, here)
    of_more = np.zeros_like(own)
    which = [j for j in range(len(free)) if moved is None or moved[j]]
    if which:
        with_more = jacobian(plant.noisier, [free[j] for j in which], point, blocks, here + more)
        of_more[:, which] = np.where(np.abs(more) < HUBER, 1.0, 0.0)[:, None] * (with_more - own[:, which])
    return np.vstack((own, of_more))


class _Objective:
    """Huber's loss of the residuals, and of what is known beforehand, over the values `x` of the free parameters.

    Rows are the residuals and, where the drive is noisy, what more of its noise adds to them: the squares of these
    count against the others'. The scale of the residuals is that of `start` throughout.
    """

    def __init__(
        self, plant: Plant, free: tuple[Free, ...], start: Point, blocks: tuple[int, ...], frozen: Array | None
    ):
        self.plant, self.free, self.start, self.blocks, self.frozen = plant, free, start, blocks, frozen
        self.low, self.high = np.array([f.low for f in free]), np.array([f.high for f in free])
        self.scales = np.array([f.scale for f in free])
        known = [(j, f.prior) for j, f in enumerate(free) if f.prior is not None]
        self.prior_slopes = np.zeros((len(known), len(free)))
        for row, (j, sd) in enumerate(known):
            self.prior_slopes[row, j] = 1.0 / sd
        self.prior_centre = np.array([f.start for f in free])
        self.x0 = np.clip(np.array([start[f.name] for f in free]), self.low, self.high)
        self.run0 = self.run(self.x0)
        self.n_blocks, self.n_rows = len(self.run0[0]), sum(r.size for r in self.run0[0])
        self.scale = scale_of(self.run0[0])

    def at(self, x: Array) -> Point:
        return {**self.start, **dict(zip([f.name for f in self.free], x.tolist(), strict=True))}

    def run(self, x: Array) -> tuple[list[Array], list[Array]]:
        """Residuals, and what more noise of the drive adds to them."""
        residuals = self.plant.residuals([self.at(x)], self.blocks)[0]
        return residuals, add_by_noise(self.plant, self.at(x), self.blocks, residuals)

    def prior(self, x: Array) -> Array:
        """Deviations from what is known beforehand, in its standard deviations."""
        return np.asarray(self.prior_slopes @ (x - self.prior_centre))

    def loss(self, rows: Array, x: Array) -> float:
        u = np.minimum(np.abs(rows[: self.n_rows]) / self.scale, RUNAWAY)
        p, more = self.prior(x) / self.scale, rows[self.n_rows :] / self.scale
        huber = np.where(u < HUBER, 0.5 * u * u, HUBER * (u - 0.5 * HUBER)).sum()
        return float(huber - 0.5 * (more @ more) + 0.5 * (p @ p))

    def slopes(self, x: Array, rows: Array, moved: NDArray[np.bool_] | None = None) -> Array:
        n_frozen = 0 if self.frozen is None else self.frozen.shape[1]
        moving = None if moved is None else moved[n_frozen:]
        own = slopes(self.plant, self.free[n_frozen:], self.at(x), self.blocks, rows, moving)
        return own if self.frozen is None else np.hstack((self.frozen, own))

    def moved(self, J: Array, rows: Array) -> NDArray[np.bool_]:
        """Parameters that noise of the drive moves, each by itself."""
        of_r, of_d = J[: self.n_rows], J[self.n_rows :]
        curvature = np.maximum(np.sum(of_r**2, axis=0), 1e-300)
        return np.asarray(np.abs(of_d.T @ rows[self.n_rows :]) > MOVED * self.scale * np.sqrt(curvature))

    def normal(self, J: Array, rows: Array, x: Array) -> tuple[Array, Array]:
        """Normal matrix and gradient with Huber's weights, for parameters in units of their scales."""
        r, d = rows[: self.n_rows], rows[self.n_rows :]
        weight = np.minimum(1.0, HUBER * self.scale / np.maximum(np.abs(r), 1e-300))
        Js, own = J * self.scales, self.prior_slopes * self.scales
        of_r, of_d = Js[: self.n_rows], Js[self.n_rows :]
        A = of_r.T @ (weight[:, None] * of_r)
        g = of_r.T @ (weight * r) - of_d.T @ d + own.T @ self.prior(x)
        return _less(A, of_d.T @ of_d) + own.T @ own, g

    def by_noise(self, J: Array) -> Array:
        """Covariance of the free parameters, were noise all that is left."""
        Js, own = J * self.scales, self.prior_slopes * self.scales
        found, *_ = self._sandwiched(Js, own.T @ own)
        return np.asarray(found * np.outer(self.scales, self.scales))

    def _sandwiched(self, Js: Array, known: Array) -> tuple[Array, Array, Array]:
        """Covariance where the residual's rows have unit noise, as for errors in the regressors; and its normal matrix.

        That one last, after its inverse.
        """
        of_r, of_d = Js[: self.n_rows], Js[self.n_rows :]
        gram = of_r.T @ of_r
        A = _less(gram, of_d.T @ of_d) + known
        inverse = np.asarray(np.linalg.pinv(A, rcond=1e-12, hermitian=True), np.float64)
        return np.asarray(inverse @ (gram + known) @ inverse), inverse, A

    def covariance(self, J: Array, rows: Array, residuals: Sequence[Array], scale: float) -> Array:
        """Of the free parameters, where residuals have this scale; each as wide as blocks disagree on it, at least."""
        Js = J * self.scales
        own = self.prior_slopes * self.scales * scale  # the prior is not loosened by a poor residual
        unit, inverse, A = self._sandwiched(Js, own.T @ own)
        found = unit * scale**2
        of_r, of_d = Js[: self.n_rows], Js[self.n_rows :]
        r, d = np.clip(rows[: self.n_rows], -HUBER * scale, HUBER * scale), rows[self.n_rows :]
        ends = pairwise(np.cumsum([0, *(block.size for block in residuals)]).tolist())
        parts = ((of_r[a:b], r[a:b], of_d[a:b], d[a:b]) for a, b in ends)
        grams = ((P.T @ P - Q.T @ Q, P.T @ own_r - Q.T @ own_d) for P, own_r, Q, own_d in parts)
        shown = left_out.covariance(A, grams, LEAST)
        wider = np.sqrt(np.maximum(np.diag(shown) / np.maximum(np.diag(found), 1e-300), 1.0))
        by = KNOWN_TO * inverse @ (of_d.T @ d)  # were there as much more of it
        found = found * np.outer(wider, wider) + np.outer(by, by)
        return np.asarray(found * np.outer(self.scales, self.scales))


def _less(A: Array, of_noise: Array) -> Array:
    """A normal matrix without what noise makes of it, of no direction more than `MOST_NOISE`."""
    if not of_noise.any():
        return A
    values, vectors = np.linalg.eigh(A)
    root = vectors * np.sqrt(np.maximum(values, 1e-12 * values[-1]))
    inverse = np.linalg.inv(root)
    share, along = np.linalg.eigh(inverse @ of_noise @ inverse.T)
    along = root @ along
    return np.asarray(A - (along * np.minimum(share, MOST_NOISE)) @ along.T)


def fit(
    plant: Plant,
    free: Sequence[Free],
    start: Point,
    blocks: Sequence[int],
    *,
    max_iterations: int = 12,
    frozen: Array | None = None,
) -> Fit:
    """Fit `free` on `blocks` from `start` (which also holds the values that stay fixed).

    Levenberg and Marquardt's method on normal equations with Huber's weights; parameters at a bound that the slope
    pushes outwards are held there. (`scipy.optimize.least_squares` decomposes the whole Jacobian in every iteration,
    ten times the cost of the simulations here.)

    `frozen`, shape (n_rows, n_known): `slopes` of the first `n_known` parameters, taken as they are instead of
    being differenced in every iteration (a few parameters are added to many that are fitted already).
    """
    of = _Objective(plant, tuple(free), start, tuple(blocks), frozen)
    x, run = of.x0, of.run0
    rows = flatten([*run[0], *run[1]])
    here, damping = of.loss(rows, x), 1e-3
    J = of.slopes(x, rows)
    moved = of.moved(J, rows)
    for _ in range(max_iterations if free else 0):
        A, g = of.normal(J, rows, x)
        held = ((x <= of.low) & (g > 0.0)) | ((x >= of.high) & (g < 0.0))
        for _ in range(N_DAMPINGS):
            x_new = np.clip(x + _step(A, g, damping, ~held) * of.scales, of.low, of.high)
            trial = of.run(x_new)
            rows_new = flatten([*trial[0], *trial[1]])
            there = of.loss(rows_new, x_new)
            if there < here:
                break
            damping = max(10.0 * damping, 1e-3)
        else:
            break
        gained, here, x, rows, run = here - there, there, x_new, rows_new, trial
        damping = max(0.1 * damping, 1e-9)
        if gained < CONVERGED:
            break
        J = of.slopes(x, rows, moved)
    residuals, more = run
    scale = scale_of(residuals)
    covariance = of.covariance(J, rows, residuals, scale) + np.diag([f.rough**2 for f in of.free])
    return Fit(of.free, of.at(x), residuals, covariance, of.blocks, scale, of.by_noise(J), more)


def _step(A: Array, g: Array, damping: float, moving: NDArray[np.bool_]) -> Array:
    """Damped Newton step of the parameters that may move, in units of their scales; at most `LONGEST` of each."""
    step = np.zeros(len(g))
    if moving.any():
        part = A[np.ix_(moving, moving)]
        ridge = damping * np.diag(part) + 1e-9 * np.trace(part) / len(part) + 1e-300
        step[moving] = -np.linalg.solve(part + np.diag(ridge), g[moving])
    longest = float(np.max(np.abs(step), initial=0.0))
    return step * min(1.0, LONGEST / longest) if longest > 0.0 else step


def best_fit(
    plant: Plant,
    free: Sequence[Free],
    starts: Sequence[Point],
    blocks: Sequence[int],
    *,
    max_iterations: int = 12,
    frozen: Array | None = None,
) -> Fit:
    """The best of fits from several starts: all are rated by one simulation each, the most promising are fitted."""
    n_fits = 1 if len(starts) <= 2 else (2 if len(starts) <= 8 else 3)
    if len(starts) > 1:
        starts = [starts[j] for j in np.argsort(rate(plant.residuals(starts, blocks)))[::-1][:n_fits]]
    fits = [fit(plant, free, s, blocks, max_iterations=max_iterations, frozen=frozen) for s in starts]
    if len(fits) == 1:
        return fits[0]
    return fits[int(np.argmax(rate([f.residuals for f in fits], [f.more for f in fits])))]
