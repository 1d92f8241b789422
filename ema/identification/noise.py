"""How much a measured envelope may differ from a model's: by switching, by the model's own error, by the start state.

    Σ(k, start) = Σ_switch + M(k) + d² (Σ_start + ‖k‖² Σ_start,k) + g gᵀ

Σ_switch: two runs of the same actuator differ by what decides its comparators. M: covariance of the model's error,
measured by the builder on held-out faults of some sizes ‖k‖, apart for faults that grow alone or in twos and threes and
for all at once, since models err differently there. Between sizes its trace follows a power of ‖k‖. Σ_start, Σ_start,k:
what is left of the start state's influence when its regressed part is taken off; it grows with the distance d of the
start from the middle of the gap at zero, and with the faults: in a worn gear the user lies farther from the motor.
g: what the start's influence changes by if the start is off by the standard deviation of its measurement.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ema.faults import N_FAULTS

D2_UNKNOWN = 4.0  # d² if nobody measured the start
D2_MAX = 25.0
N_START = 2 + 2 * N_FAULTS + 3


@dataclass(frozen=True)
class NoiseModel:
    """Covariances at the schedule and the start state's linear influence.

    Attributes
    ----------
    switching : array, shape (n_omega, n_omega)
        Covariance of one run of an actuator. [A²]
    sizes : array, shape (m,)
        Sizes ‖k‖ at which the model's error was measured, ascending. [1]
    spreads : array, shape (2,)
        Mean `spread` of the few and of the many faults with which it was measured. [1]
    model_error : array, shape (2, m, n_omega, n_omega)
        Covariance of the model's error for few and for many faults at these sizes. [A²]
    start, start_k : arrays, shape (n_omega, n_omega)
        Covariances for a start at d = 1, without faults and by ‖k‖² of them. [A²]
    B : array, shape (n_omega, N_START)
        Influence of the start state, regressed on `start_features`. [A]
    start_scale : array, shape (2,)
        Start offsets for which d is 1. [rad]
    start_sd : array, shape (2,)
        Standard deviation of a measured start. [rad]
    """

    switching: np.ndarray
    sizes: np.ndarray
    spreads: np.ndarray
    model_error: np.ndarray
    start: np.ndarray
    start_k: np.ndarray
    B: np.ndarray
    start_scale: np.ndarray
    start_sd: np.ndarray = field(default_factory=lambda: np.zeros(2))

    def start_shift(self, start: np.ndarray | None, k: np.ndarray) -> np.ndarray:
        """Influence of the start state on the envelope with faults `k` (..., 6), shape (..., n_omega). [A]"""
        if start is None:
            return np.zeros((*k.shape[:-1], len(self.B)))
        return np.asarray(start_features(start / self.start_scale, k) @ self.B.T)

    def covariance(self, start: np.ndarray | None, k: np.ndarray) -> np.ndarray:
        """Σ for a cycle that began at `start` with faults near `k`."""
        return self.of_a_cycle(start, k) + self.of_model(k)

    def of_a_cycle(self, start: np.ndarray | None, k: np.ndarray) -> np.ndarray:
        """The part of Σ that is drawn anew in each cycle: all but the model's error. [A²]"""
        d2 = D2_UNKNOWN if start is None else min(float(np.sum((start / self.start_scale) ** 2)), D2_MAX)
        far_off = d2 * (self.start + float(k @ k) * self.start_k)
        return self.switching + far_off + self.of_measured_start(start, k)

    def of_measured_start(self, start: np.ndarray | None, k: np.ndarray) -> np.ndarray:
        """What an inexact start adds, shape (n_omega, n_omega); nothing where it is unknown. [A²]"""
        if start is None or not self.start_sd.any():
            return np.zeros_like(self.switching)
        at, *off = (self.start_shift(start + ds, k[:N_FAULTS]) for ds in (np.zeros(2), *np.diag(self.start_sd)))
        g = np.array(off) - at
        return np.asarray(g.T @ g)

    def of_model(self, k: np.ndarray) -> np.ndarray:
        """M(k), shape (n_omega, n_omega); beyond the sizes measured as between the last two. [A²]"""
        size = float(np.sqrt(k @ k))
        if size == 0.0:
            return np.zeros_like(self.switching)
        few, many = self.spreads
        share = min(max((spread(k) - few) / (many - few), 0.0), 1.0)
        log_size, log_trace, shape = self._levels
        place = float(np.interp(np.log(size), log_size[1:-1], np.arange(len(self.sizes))))
        lower = min(int(place), len(self.sizes) - 2)
        M = np.zeros_like(self.switching)
        for part, half in ((1.0 - share, 0), (share, 1)):
            trace = part * np.exp(np.interp(np.log(size), log_size, log_trace[half]))
            M += trace * (1.0 + lower - place) * shape[half, lower] + trace * (place - lower) * shape[half, lower + 1]
        return M

    @cached_property
    def _levels(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Logarithms of size (m + 2,) and of M's trace (2, m + 2), both continued to either side; M of trace one."""
        trace = np.maximum(np.trace(self.model_error, axis1=-2, axis2=-1), 1e-9 * np.trace(self.switching))
        log_size, log_trace, far = np.log(self.sizes), np.log(trace), 20.0
        power = np.diff(log_trace[:, -2:])[:, 0] / np.diff(log_size[-2:])
        continued = np.column_stack([log_trace[:, 0] - 2.0 * far, log_trace, log_trace[:, -1] + power * far])
        sizes = np.array([log_size[0] - far, *log_size, log_size[-1] + far])
        return sizes, continued, self.model_error / trace[..., None, None]

    def beyond(self, k: np.ndarray) -> bool:
        """Whether the faults are clearly larger than any the model was measured for."""
        return bool(np.sqrt(k @ k) > 1.25 * self.sizes[-1])


def start_features(s: np.ndarray, k: np.ndarray) -> np.ndarray:
    """What the start's influence is regressed on: s, its products with the faults and with itself.

    `s` (..., 2) start over its scale, `k` (..., 6); shape (..., N_START).
    """
    s = np.broadcast_to(s, (*k.shape[:-1], 2))
    with_faults = (s[..., :, None] * k[..., None, :]).reshape(*k.shape[:-1], 2 * N_FAULTS)
    return np.concatenate([s, with_faults, s**2, s[..., :1] * s[..., 1:]], axis=-1)


def spread(k: np.ndarray) -> np.ndarray:
    """How evenly the size of fault vectors `k` (..., d) is spread over their elements, 1/d (one alone) … 1.

    (Σ |k_j|)² / (d Σ k_j²)
    """
    return np.asarray(np.sum(np.abs(k), axis=-1) ** 2 / (k.shape[-1] * np.sum(k**2, axis=-1)))
