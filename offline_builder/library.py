"""Fit the LF2 library, eq. (1) of the paper, to sweeps of one fault at a time."""

from __future__ import annotations

import numpy as np

from ema.models.lf2 import Lf2

from .config import Builder
from .runs import Plan
from .snapshots import Snapshots


def fit_library(envelopes: Snapshots, plan: Plan, builder: Builder, i0: np.ndarray) -> Lf2:
    """The library over the whole cycle."""

    def deviations(fault: str, levels: list[float]) -> np.ndarray:
        return np.array(
            [envelopes[plan.groups[f"level {fault} {level:g}"]].mean(axis=0, dtype=float) - i0 for level in levels]
        )

    lib = builder.library
    k1, k2, k3_5, k6 = (np.array(x) for x in (lib.k1_levels, lib.k2_levels, lib.phase_levels, lib.k6_levels))
    f1, i_SF = polynomial_times_shape(k1, deviations("k1", lib.k1_levels)[None], lib.degree_f1)
    phases = np.array([modulation(deviations(f"k{j}", lib.phase_levels), i0) for j in (3, 4, 5)])
    f2, i_PH = polynomial_times_shape(k3_5, phases, lib.degree_f2)
    zero = np.zeros((1, len(i0)))
    return Lf2(
        i0=i0,
        i_SF=i_SF[0],
        i_PH=i_PH,
        f1=f1,
        f2=f2,
        k2_levels=np.concatenate([[0.0], k2]),
        i_BLK=np.vstack([zero, deviations("k2", lib.k2_levels)]),
        k6_levels=np.concatenate([[0.0], k6]),
        i_zeta=np.vstack([zero, modulation(deviations("k6", lib.k6_levels), i0)]),
    )


def modulation(deviation: np.ndarray, i0: np.ndarray) -> np.ndarray:
    """m with i₀ m ≈ Δi, damped where i₀ is near zero.   m = Δi i₀ / (i₀² + ε²)"""
    epsilon = 0.05 * np.sqrt(np.mean(i0**2))
    return deviation * i0 / (i0**2 + epsilon**2)


def polynomial_times_shape(k: np.ndarray, d: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Fit d[s, l, :] ≈ f(k[l]) shape[s, :] with one polynomial f = k + c₂k² + … for all shapes.

    Alternating least squares from the best rank-one start; each half step is linear.
    """
    P = k[:, None] ** np.arange(1, degree + 1)
    f = k.copy()
    for _ in range(50):
        shape = np.einsum("l,slt->st", f, d) / (f @ f)
        values = np.einsum("st,slt->l", shape, d) / np.sum(shape**2)
        c = np.linalg.lstsq(P, values, rcond=None)[0]
        f = P @ c
    scale = c[0] if abs(c[0]) > 1e-12 else 1.0
    return c / scale, shape * scale
