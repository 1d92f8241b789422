"""How much two runs of the same actuator differ, and whether a residual is more than that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import gamma

from ema.core.records import Array
from ema.discrepancy.actuator.reading.thinning import choose_evenly
from ema.discrepancy.engine.hypothesis import Point
from ema.discrepancy.engine.statistic import Root

from .runs import Runs

if TYPE_CHECKING:
    from ema.discrepancy.actuator.reading.measured import Measured

    from .plant import EmaPlant

N_RUNS = 96, 48  # for the covariance, for the null distribution
N_RUNS_SURE = 288, 192  # where it is close
N_CYCLES = 6  # of a motion that are simulated for its noise: deviations from the mean of too few runs are alike
SEED = 7_000_000
FALSE_ALARMS = 0.004  # of the whole verdict; the aim is 1 %, and the null distribution is itself estimated


@dataclass(frozen=True)
class MotionNoise:
    """Noise of one motion at one point.

    Attributes
    ----------
    sd : array, shape (n_features,)
        With the floor of each feature.
    root : Root
        Of the inverse of the correlation.
    envelope_sd : array
        Of the envelope. [A]
    fresh : array, shape (n_fresh, n_features)
        Whitened deviations of runs that the covariance has not seen.
    step : array of int, shape (n_fresh,)
        Which of the plant's `noise_steps` each of these runs has.
    """

    sd: Array
    root: Root
    envelope_sd: Array
    fresh: Array
    step: np.ndarray

    def white(self, x: Array) -> Array:
        """Whitened rows of `x`, shape (..., n_features)."""
        return self.root(x / self.sd)

    def unwhite(self, x: Array) -> Array:
        """The rows of which `white` makes `x`, shape (..., n_features)."""
        return self.root.inverse(x) * self.sd


def _repeats(plant: EmaPlant, motion: int, n_runs: tuple[int, int]) -> tuple[list[int], int]:
    """Cycles of a motion that are simulated for its noise, and how often each."""
    cycles: list[int] = choose_evenly(np.flatnonzero(plant.data.motion == motion), N_CYCLES).tolist()
    return cycles, -(-sum(n_runs) // len(cycles))


def _simulate(plant: EmaPlant, point: Point, n_runs: tuple[int, int]) -> list[Runs]:
    """Runs of every motion, cycle by cycle: motions that last as long share batches of lanes."""
    repeats = [_repeats(plant, motion, n_runs) for motion in range(plant.n_motions)]
    found: dict[int, Runs] = {}
    for length in {len(command) for command in plant.data.commands}:
        same = [m for m, command in enumerate(plant.data.commands) if len(command) == length]
        of = {m: np.repeat(repeats[m][0], repeats[m][1]).tolist() for m in same}
        cycles = [c for m in same for c in of[m]]
        seeds = [seed for m in same for seed in range(SEED, SEED + len(of[m]))]
        runs = plant.simulate([point] * len(cycles), cycles, seeds, steps=plant.noise_steps)
        ends = np.cumsum([len(of[m]) for m in same])[:-1]
        parts = zip(np.split(runs.features, ends), np.split(runs.envelopes, ends), strict=True)
        found |= {m: Runs(*part) for m, part in zip(same, parts, strict=True)}
    return [found[m] for m in range(plant.n_motions)]


def measure_motion_noise(plant: EmaPlant, motion: int, runs: Runs, n_runs: tuple[int, int]) -> MotionNoise:
    """How runs of one cycle of a motion differ.

    Beside what is random stands what no record tells: the grid on which the comparators are evaluated. It rounds every
    switching instant, which shifts local means of the current by up to a quarter of (slope × step), alike in every run
    with this step. So runs have several steps, and what the step makes is part of the noise.
    """
    cycles, each = _repeats(plant, motion, n_runs)
    n = len(runs.features)
    floor = plant.floors[motion] * np.random.default_rng(SEED).standard_normal((n, len(plant.floors[motion])))

    def deviations(x: Array) -> Array:
        """From the mean of the runs of the same cycle, as large as from a mean over many."""
        by_cycle = x.reshape(len(cycles), each, -1)
        away = (by_cycle - by_cycle.mean(axis=1, keepdims=True)) * np.sqrt(each / (each - 1.0))
        return away.transpose(1, 0, 2).reshape(n, -1)

    n_seen = n * n_runs[0] // sum(n_runs)
    x, new = np.split(deviations(runs.features + floor), [n_seen])
    step = (np.arange(n) % len(plant.noise_steps)).reshape(len(cycles), each).T.ravel()[n_seen:]
    sd = np.sqrt((x**2).mean(axis=0))
    root = Root.of(x / sd)
    return MotionNoise(sd, root, deviations(runs.envelopes).std(axis=0), root(new / sd), step)


class Noise:
    """Noise of every motion near one point."""

    def __init__(self, plant: EmaPlant, point: Point, n_runs: tuple[int, int] = N_RUNS):
        self.plant, self.point = plant, dict(point)
        runs = _simulate(plant, point, n_runs)
        self.motions = [measure_motion_noise(plant, m, of, n_runs) for m, of in enumerate(runs)]

    def of(self, cycle: int) -> MotionNoise:
        """Noise of the motion a cycle belongs to."""
        return self.motions[int(self.plant.data.motion[cycle])]

    def misfit(self, residuals: Sequence[Array], cycles: Sequence[int]) -> float:
        """Sum of squared whitened residuals over what noise makes of it; about one if the model is right."""
        return sum(float(r @ r) for r in residuals) / self.expected(cycles)

    def expected(self, cycles: Sequence[int]) -> float:
        """What noise makes of the sum of squared whitened residuals."""
        return sum(float((self.of(c).fresh ** 2).sum(axis=1).mean()) for c in cycles)


def scatter(noise: Noise, solution: Sequence[Array], cycles: Sequence[int]) -> Array:
    """Covariance of a linear estimate, shape (n, n), from runs that the weights have not seen.

    What is random differs from cycle to cycle. What the step of the comparators makes is the same in all cycles of a
    record, and no record tells the step; its part is the product of two halves of the runs, without a share of chance.

    Parameters
    ----------
    solution : sequence of arrays, shape (n, n_features)
        The estimate is the sum over cycles of these times the whitened features.
    """
    n, steps = len(solution[0]), range(len(noise.plant.noise_steps))
    random, by_step = np.zeros((n, n)), np.zeros((2, len(steps), n))
    for c, G in zip(cycles, solution, strict=True):
        of = noise.of(c)
        x = of.fresh @ G.T
        groups = [x[of.step == s] for s in steps]
        random += sum((len(g) - 1) * np.cov(g.T) for g in groups) / (len(x) - len(steps))
        by_step += np.array([[g[half::2].mean(axis=0) for g in groups] for half in (0, 1)])
    common = by_step[0].T @ by_step[1] / (len(steps) - 1)
    common = 0.5 * (common + common.T)
    return random + common * np.outer(sign := np.diag(common) > 0.0, sign)


def disagreement(data: Measured, solution: Sequence[Array], residuals: Sequence[Array], cycles: Sequence[int]) -> Array:
    """Covariance of a linear estimate, shape (n, n), from how differently the motions of a record draw it.

    The sandwich covariance with motions as clusters: it sees a law of another form, which noise does not. [Liang and
    Zeger, Biometrika 73, 1986]
    """
    motions = sorted({int(data.motion[c]) for c in cycles})
    drawn = np.zeros((len(motions), len(solution[0])))
    for c, G, r in zip(cycles, solution, residuals, strict=True):
        drawn[motions.index(int(data.motion[c]))] += G @ r
    away = drawn - drawn.mean(axis=0)
    return np.asarray(away.T @ away) * len(motions) / max(len(motions) - 1, 1)


@dataclass(frozen=True)
class Verdict:
    """Whether residuals are noise: the corrected p-value, and z-score by feature group."""

    p_value: float
    scores: dict[str, float]

    @property
    def is_noise(self) -> bool:
        """True where the residual is compatible with noise."""
        return self.p_value >= FALSE_ALARMS

    @property
    def loudest(self) -> str:
        """The group that speaks most clearly."""
        return max(self.scores, key=lambda name: self.scores[name])


def judge(
    noise: Noise, residuals: Sequence[Array], cycles: Sequence[int], columns: Sequence[Array], extra: float
) -> Verdict:
    """Test whitened residuals of cycles, group by group, against runs of the fitted simulation itself.

    Each statistic is a sum of squares of the whitened residual less what the fitted columns can take up; its null
    distribution is a gamma with mean and variance from runs that neither mean nor covariance have seen. Cycles of one
    motion share what the integration step makes of it, so their sums of squares are taken for fully correlated.

    Parameters
    ----------
    columns : sequence of arrays, shape (n_features, n_free)
        Whitened Jacobian of each motion.
    extra : float
        Variance of the predicted mean over that of one run (1 / number of seeds).
    """
    slices = [noise.plant.slices[int(noise.plant.data.motion[c])] for c in cycles]
    names = list(slices[0])
    bases = [np.linalg.qr(A)[0] if A.shape[1] else A for A in columns]
    scores, p = {}, {}
    for name in (*names, "all"):
        statistic, mean = 0.0, 0.0
        sd = np.zeros(noise.plant.n_motions)
        for cycle, r, where in zip(cycles, residuals, slices, strict=True):
            motion = int(noise.plant.data.motion[cycle])
            Q, at = bases[motion], where.get(name, slice(None))
            fresh = noise.motions[motion].fresh
            null = ((fresh - fresh @ Q @ Q.T)[:, at] ** 2).sum(axis=1) * (1.0 + extra)
            statistic += float((r - Q @ (Q.T @ r))[at] @ (r - Q @ (Q.T @ r))[at])
            mean += float(null.mean())
            sd[motion] += np.sqrt(float(null.var(ddof=1)) * (1.0 + 1.0 / len(null)))
        variance = float(sd @ sd)
        scale = variance / mean
        p[name] = float(gamma.sf(statistic, mean / scale, scale=scale))
        scores[name] = (statistic - mean) / np.sqrt(variance)
    return Verdict(min(1.0, min(p.values()) * len(p)), scores)
