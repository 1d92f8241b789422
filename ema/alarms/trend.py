"""How fast each fault grows, and when it will be at a level, in memory that does not grow.

A straight line k = a + b t through all estimates, t = 0 now, each weighed by 1/sd² and forgotten by λ = exp(-Δt/τ):

    [a b]ᵀ = P Σ λ w [1 t]ᵀ k,    P = (Σ λ w [1 t]ᵀ[1 t])⁻¹,    cov = P (Σ λ² w [1 t]ᵀ[1 t]) P · max(1, χ²/ν)

The sums are moved on to each new estimate's time. Time is that of operation: breaks are left out.
"""

from __future__ import annotations

import numpy as np

from ema.core.names import FAULTS

HOUR = 3600.0  # [s]
_N = len(FAULTS)
_SD_LEAST = 1e-4  # an estimate at a bound may claim less


class Trend:
    """Of the six faults of one actuator.

    Parameters
    ----------
    memory : float
        τ. [s]
    least : int
        Estimates before anything is told.
    longest_gap : float
        A longer silence is a break. [s]
    """

    def __init__(self, memory: float, least: int, longest_gap: float):
        self._memory, self._least, self._longest_gap = memory, least, longest_gap
        self._n = 0
        self._t_ns = 0
        self._once = np.zeros((3, _N))  # Σ λ w [1 t t²]
        self._twice = np.zeros((3, _N))  # Σ λ² w [1 t t²]
        self._k = np.zeros((2, _N))  # Σ λ w [k t k]
        self._kk = np.zeros(_N)  # Σ λ w k²
        self._count = 0.0  # Σ λ

    def update(self, t_ns: int, k: np.ndarray, sd: np.ndarray) -> None:
        """Take one estimate; arrays of shape (6,)."""
        elapsed = (t_ns - self._t_ns) / 1e9
        if self._n and 0.0 < elapsed <= self._longest_gap:
            self._move(elapsed)
        self._t_ns = t_ns
        w = 1.0 / np.maximum(sd, _SD_LEAST) ** 2
        self._once[0] += w
        self._twice[0] += w
        self._k[0] += w * k
        self._kk += w * k**2
        self._count += 1.0
        self._n += 1

    def _move(self, elapsed: float) -> None:
        """All that was seen lies so much farther back."""
        forget = np.exp(-elapsed / self._memory)
        for sums, factor in ((self._once, forget), (self._twice, forget**2)):
            s0, s1, s2 = sums
            sums[:] = factor * np.array([s0, s1 - elapsed * s0, s2 - 2.0 * elapsed * s1 + elapsed**2 * s0])
        self._k[:] = forget * np.array([self._k[0], self._k[1] - elapsed * self._k[0]])
        self._kk *= forget
        self._count *= forget

    def line(self) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
        """k now, its rate and the rate's standard deviation, each of shape (6,); None before they are known."""
        s0, s1, s2 = self._once
        det = s0 * s2 - s1**2
        if self._n < self._least or not (det > 1e-9 * s0 * s2).all():
            return None
        q0, q1, q2 = self._twice
        a = (s2 * self._k[0] - s1 * self._k[1]) / det
        b = (s0 * self._k[1] - s1 * self._k[0]) / det
        chi2 = np.maximum(self._kk - a * self._k[0] - b * self._k[1], 0.0)
        scatter = np.maximum(1.0, chi2 / max(self._count - 2.0, 1.0))
        variance = (s1**2 * q0 - 2.0 * s0 * s1 * q1 + s0**2 * q2) / det**2
        return a, HOUR * b, HOUR * np.sqrt(variance * scatter)

    def snapshot(self) -> dict[str, object]:
        """To be restored."""
        sums = {name: getattr(self, f"_{name}").tolist() for name in ("once", "twice", "k", "kk")}
        return {"n": self._n, "t_ns": self._t_ns, "count": self._count, **sums}

    def restore(self, stored: dict) -> None:
        """Go on from a snapshot."""
        self._n, self._t_ns, self._count = int(stored["n"]), int(stored["t_ns"]), float(stored["count"])
        for name in ("once", "twice", "k", "kk"):
            value = np.array(stored[name], float)
            if value.shape != getattr(self, f"_{name}").shape:
                raise ValueError(f"trend.{name} has shape {value.shape}")
            setattr(self, f"_{name}", value)


def life(k: float, rate: float, sd: float, level: float, deviations: float) -> tuple[float, float]:
    """Earliest and latest time from now at which k passes `level` at a rate within ± `deviations` of sd. [h]

    Infinite where it does not; (0, 0) where it has.
    """
    left = level - k
    if left <= 0.0:
        return 0.0, 0.0
    fast, slow = rate + deviations * sd, rate - deviations * sd
    return (left / fast if fast > 0.0 else np.inf), (left / slow if slow > 0.0 else np.inf)
