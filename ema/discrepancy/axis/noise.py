"""Noise of a channel: declared in the plant file, or estimated from what neighbouring samples cannot agree on."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from ema.core.records import Array, Cycle

N_BINS = 8
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
    """

    sigma: float
    jitter: float = 0.0
    declared: bool = False

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
    """Step of a quantised channel, 0 if there is none."""
    values = np.unique(x)
    if len(values) < 2 or len(values) > len(x) / 3:
        return 0.0
    return float(np.percentile(np.diff(values), 10))


def estimate(cycles: tuple[Cycle, ...], name: str, resolution: float | None) -> Noise:
    """Estimate from a channel's cycles: robust, and rather too large than too small (fast motion counts as noise)."""
    parts = [disagreement(cycle["t"], cycle[name]) for cycle in cycles if cycle.n_samples > 8]
    everything = np.concatenate([cycle[name] for cycle in cycles])
    step = resolution or quantum(everything)
    floor = max(step / np.sqrt(12.0), 1e-9 * float(np.std(everything)), 1e-12)
    if not parts:
        return Noise(floor)
    r = np.concatenate([p[0] for p in parts])
    slope = np.abs(np.concatenate([p[1] for p in parts]))
    edges = np.quantile(slope, np.linspace(0.0, 1.0, N_BINS + 1))
    variance, square, weight = [], [], []
    for low, high in pairwise(edges):
        inside = (slope >= low) & (slope <= high)
        if inside.sum() > 20:
            variance.append(_robust_variance(r[inside]))
            square.append(float(np.mean(slope[inside] ** 2)))
            weight.append(1.0 / max(variance[-1], floor**2))
    if not variance:
        return Noise(max(floor, float(np.sqrt(_robust_variance(r)))))
    v, s, w = np.array(variance), np.array(square), np.array(weight)
    (a, b), _ = nnls(np.stack([w, w * s], axis=1), w * v)
    return Noise(max(float(np.sqrt(a)), floor), float(np.sqrt(b)))


def _robust_variance(r: Array) -> float:
    """Variance without the wildest samples; by a high quantile where the tails are heavy (irregular sampling)."""
    wide = float(np.quantile(np.abs(r), 0.95))
    middle = r[np.abs(r) <= 2.0 * wide]
    return max(float(np.mean(middle**2)) if middle.size else 0.0, (wide / 1.96) ** 2)
