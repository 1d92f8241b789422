"""Noise of a channel: declared in the plant file, or estimated from what neighbouring samples cannot agree on."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from ema.core.records import Array, Cycle

DRIVES = ("torque", "force", "i_q", "u_q", "duty")  # may be commands; the first of them that is there drives
LEVELS = 5  # values up to which a channel goes between levels
N_BINS = 8
MAX_SAMPLES = 4000  # of a cycle, to see how a channel was made
MIN_STEPS = 20  # steps of few counts from which a lattice can be told
SIMULATED_TO = 3e-4  # of a channel's size: what is lost between samples of the drive
SENSOR = 2.0**-16  # of a channel's size: the noise of a sensor is no less, that of rounding may be
ROUNDED = 2.0  # times the rms of steps: noise is the channel's own where it is more
TO_ONE_SIDE = 0.5  # share of neighbours that disagree to the same side: 0.2 of noise, 1 of a smooth channel
DERIVED = 0.02  # of its noise: what may be left of a speed that is computed from the position
ESTIMATE_UNCERTAINTY = 0.1  # relative, of an estimated amplitude


@dataclass(frozen=True)
class Noise:
    """Noise amplitude  σ² = σ₀² + (σ_t dx/dt)²: of the sensor, and of the moment of sampling.

    Attributes
    ----------
    sigma : float
        rms at rest. [unit of the channel]
    jitter : float
        rms of the sampling time. [s]
    declared : bool
    is_bound : bool
        The channel shows no noise of its own, or less than what no simulation is expected to be better than.
    """

    sigma: float
    jitter: float = 0.0
    declared: bool = False
    is_bound: bool = False

    def rms(self, slope: Array) -> Array:
        """Rms at a given slope of the channel, shape of `slope`."""
        return np.sqrt(self.sigma**2 + (self.jitter * slope) ** 2)


def disagreement(t: Array, x: Array) -> tuple[Array, Array, NDArray[np.int_]]:
    """Each sample less the cubic through its four neighbours, scaled to the sample's own noise.

    Returns
    -------
    r, slope : arrays, shape (n_times - 4,)
        Disagreement, and slope of the channel at the same samples.
    inside : array of int
        Their sample numbers.
    """
    n = len(t)
    inside = np.arange(2, n - 2)
    at = [inside - 2, inside - 1, inside + 1, inside + 2]
    here = t[inside]
    weights = []
    for j, a in enumerate(at):
        w = np.ones(len(inside))
        for k, b in enumerate(at):
            if k != j:
                w = w * (here - t[b]) / (t[a] - t[b])
        weights.append(w)
    r = x[inside] - sum(w * x[a] for w, a in zip(weights, at, strict=True))
    spread = np.sqrt(1.0 + sum(w**2 for w in weights))
    slope = (x[at[2]] - x[at[1]]) / (t[at[2]] - t[at[1]])
    return r / spread, slope, inside


def quantum(x: Array) -> float:
    """Step of a quantised channel, 0 where its values lie on no lattice (or it is too fast for that to matter)."""
    d = np.abs(np.diff(x))
    d = d[d > 0.0]
    if len(d) < 2 * MIN_STEPS:
        return 0.0
    step = float(np.mean(d[d < 1.5 * d.min()]))
    n = d[d < 20.0 * step] / step
    if len(n) < MIN_STEPS or np.mean(np.abs(n - np.round(n)) < 0.1) < 0.95:
        return 0.0
    return step


def is_levelled(name: str, x: Array) -> bool:
    """Whether a channel that drives goes between a few levels: a command, which is exact, and no coarse reading."""
    return name in DRIVES and len(np.unique(x)) <= LEVELS


def estimate(cycles: tuple[Cycle, ...], name: str, resolution: float | None, size: float = 0.0) -> Noise:
    """Estimate from a channel's cycles: robust, rather too large than too small (fast motion counts as noise).

    Of a channel of this `size` that shows no noise of its own, a bound is all that is known: what no simulation is
    expected to be better than.
    """
    everything = np.concatenate([cycle[name] for cycle in cycles])
    if is_levelled(name, everything):
        return _bounded(1e-12, 0.0, SIMULATED_TO * size)
    step = resolution or max(quantum(cycle[name]) for cycle in cycles)
    of_steps = step / np.sqrt(12.0)
    floor = max(of_steps, 1e-9 * float(np.std(everything)), 1e-12)
    parts = [disagreement(cycle["t"], cycle[name]) for cycle in cycles if cycle.n_samples > 8]
    if not parts:
        return _bounded(floor, 0.0, SIMULATED_TO * size)
    r, slope = [p[0] for p in parts], [p[1] for p in parts]
    sigma, jitter = _fit_amplitudes(np.concatenate(r), np.abs(np.concatenate(slope)), of_steps, floor)
    of_its_own = sigma > max(ROUNDED * of_steps, SENSOR * size) and _share_to_one_side(r) < TO_ONE_SIDE
    return Noise(sigma, jitter) if of_its_own else _bounded(sigma, jitter, SIMULATED_TO * size)


def _fit_amplitudes(r: Array, slope: Array, of_steps: float, floor: float) -> tuple[float, float]:
    """σ₀ and σ_t of what samples disagree by, over those of like `slope` (its size)."""
    edges = np.quantile(slope, np.linspace(0.0, 1.0, N_BINS + 1))
    variance, square, weight = [], [], []
    for low, high in pairwise(edges):
        inside = (slope >= low) & (slope <= high)
        if inside.sum() > 20:
            variance.append(_robust_variance(r[inside], of_steps))
            square.append(float(np.mean(slope[inside] ** 2)))
            weight.append(1.0 / max(variance[-1], floor**2))
    if not variance:
        return max(floor, float(np.sqrt(_robust_variance(r, of_steps)))), 0.0
    v, s, w = np.array(variance), np.array(square), np.array(weight)
    (a, b), _ = nnls(np.stack([w, w * s], axis=1), w * v)
    return max(float(np.sqrt(a)), floor), float(np.sqrt(b))


def _share_to_one_side(r: list[Array]) -> float:
    """Share of neighbouring samples, in each cycle, that disagree with theirs to the same side."""
    return float(np.mean(np.concatenate([np.sign(x[1:]) == np.sign(x[:-1]) for x in r])))


def _bounded(sigma: float, jitter: float, least: float) -> Noise:
    return Noise(max(sigma, least), jitter, is_bound=sigma <= least)


def is_derived(cycle: Cycle, position: str, speed: str) -> bool:
    """Whether the speed is computed from neighbouring samples of the position (differences, with or without a filter).

    Such a channel repeats the position's noise and says nothing that the position does not.
    """
    reach = 8
    w, d = cycle[speed][:MAX_SAMPLES], np.diff(cycle[position][: MAX_SAMPLES + 1])
    n = min(len(w), len(d))
    if n < 20 * reach:
        return False
    noise = np.sqrt(_robust_variance(disagreement(cycle["t"][:n], w[:n])[0]))
    if noise < SIMULATED_TO * np.sqrt(np.mean(w**2)):
        return False
    inside = np.arange(reach, n - reach)
    columns = [d[inside + k] for k in range(-reach, reach + 1)]
    A = np.stack([*columns, w[inside - 1], np.ones(len(inside))], axis=1)
    A = A / np.maximum(np.linalg.norm(A, axis=0), 1e-300)
    c, *_ = np.linalg.lstsq(A, w[inside], rcond=1e-12)
    return bool(np.sqrt(np.mean((w[inside] - A @ c) ** 2)) < DERIVED * noise)


def _robust_variance(r: Array, of_steps: float = 0.0) -> float:
    """Variance without the wildest samples; by a high quantile where the tails are heavy (irregular sampling).

    Where a channel's steps make most of it (rms `of_steps`), its tail is a step now and then, of which no quantile
    says how large the rest is.
    """
    wide = float(np.quantile(np.abs(r), 0.95))
    middle = r[np.abs(r) <= 2.0 * wide]
    variance = float(np.mean(middle**2)) if middle.size else 0.0
    return variance if variance < 2.0 * of_steps**2 else max(variance, (wide / 1.96) ** 2)
