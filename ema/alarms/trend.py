"""How fast each fault grows, and when it will be at a level, in memory that does not grow.

A plane k = a + b t + c θ through all estimates, t = 0 now, θ the winding's temperature less 20 °C: warm magnets look
like shorted turns, and what follows the temperature is no wear. Each is weighed by 1/sd² and forgotten by
λ = exp(-Δt/τ); beforehand c is 0 ± s_c:

    β = [a b c]ᵀ = P Σ λ w x k,    x = [1 t θ]ᵀ,    P = (Σ λ w x xᵀ + Λ)⁻¹,    Λ = diag(0, 0, 1/s_c²)
    cov = P (Σ λ² w x xᵀ + Λ) P · max(1, χ²/ν)

The sums are moved on to each new estimate's time. Time is that of operation: breaks are left out.
"""

from __future__ import annotations

import numpy as np

from ema.core.names import FAULTS

HOUR = 3600.0  # [s]
ROOM = 20.0  # [°C]
_N = len(FAULTS)
_SD_LEAST = 1e-4  # an estimate at a bound may claim less


class Trend:
    """Of the six faults of one actuator.

    Parameters
    ----------
    memory : float
        τ. [s]
    per_kelvin : float
        s_c: by which a kelvin may move k. [1/K]
    least : int
        Estimates before anything is told.
    longest_gap : float
        A longer silence is a break. [s]
    """

    def __init__(self, memory: float, per_kelvin: float, least: int, longest_gap: float):
        self._memory, self._least, self._longest_gap = memory, least, longest_gap
        self._prior = np.diag([0.0, 0.0, per_kelvin**-2])
        self._n = 0
        self._t_ns = 0
        self._once = np.zeros((_N, 3, 3))  # Σ λ w x xᵀ
        self._twice = np.zeros((_N, 3, 3))  # Σ λ² w x xᵀ
        self._k = np.zeros((_N, 3))  # Σ λ w x k
        self._kk = np.zeros(_N)  # Σ λ w k²
        self._count = 0.0  # Σ λ

    def update(self, t_ns: int, k: np.ndarray, sd: np.ndarray, temp_w: float = ROOM) -> None:
        """Take one estimate; arrays of shape (6,), temperature of the winding [°C]."""
        elapsed = (t_ns - self._t_ns) / 1e9
        if self._n and 0.0 < elapsed <= self._longest_gap:
            self._move(elapsed)
        self._t_ns = t_ns
        w = 1.0 / np.maximum(sd, _SD_LEAST) ** 2
        x = np.array([1.0, 0.0, temp_w - ROOM])
        seen = w[:, None, None] * np.outer(x, x)
        self._once += seen
        self._twice += seen
        self._k += (w * k)[:, None] * x
        self._kk += w * k**2
        self._count += 1.0
        self._n += 1

    def _move(self, elapsed: float) -> None:
        """All that was seen lies so much farther back."""
        forget = np.exp(-elapsed / self._memory)
        back = np.array([[1.0, 0.0, 0.0], [-elapsed, 1.0, 0.0], [0.0, 0.0, 1.0]])
        self._once = forget * (back @ self._once @ back.T)
        self._twice = forget**2 * (back @ self._twice @ back.T)
        self._k = forget * (self._k @ back.T)
        self._kk *= forget
        self._count *= forget

    def line(self) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
        """k now, its rate and the rate's standard deviation, each of shape (6,); None before they are known."""
        s0, s1, s2 = self._once[:, 0, 0], self._once[:, 0, 1], self._once[:, 1, 1]
        if self._n < self._least or not (s0 * s2 - s1**2 > 1e-9 * s0 * s2).all():
            return None
        P = np.linalg.inv(self._once + self._prior)
        beta = (P @ self._k[:, :, None])[:, :, 0]
        chi2 = np.maximum(self._kk - np.sum(beta * self._k, axis=1), 0.0)
        scatter = np.maximum(1.0, chi2 / max(self._count - 3.0, 1.0))
        variance = (P @ (self._twice + self._prior) @ P)[:, 1, 1] * scatter
        theta = self._once[:, 0, 2] / s0  # where the middle of what is remembered lies
        return beta[:, 0] + beta[:, 2] * theta, HOUR * beta[:, 1], HOUR * np.sqrt(variance)

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
