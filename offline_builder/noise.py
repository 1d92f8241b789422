"""Measure how far the envelope strays: by switching, by each model's error, by the start state."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ema.identification.known_error import KnownError
from ema.identification.noise import spread, start_features

from .config import Builder
from .runs import START_OFFSET, Plan
from .snapshots import Snapshots

Model = Callable[[np.ndarray], np.ndarray]  # points x = [k; ν] (n, 6 + m) → envelopes at the schedule (n, n_omega)
Sets = list[tuple[np.ndarray, np.ndarray, np.ndarray]]  # see `heldout`
KNEE = 0.15  # size ‖k‖ up to which the known error is to be followed to the noise


def corrected(model: Model, error: KnownError) -> Model:
    """The model with its known error taken off."""
    return lambda k: model(k) + error(k)


def unbiased(S: np.ndarray, n: float) -> np.ndarray:
    """Covariance scaled so that its inverse is right on average (Hartlap et al., A&A 464 (2007) 399)."""
    return S * (n / max(n - len(S) - 2, 0.4 * n))


def shrunk(S: np.ndarray, n: int) -> np.ndarray:
    """Lightly drawn towards its diagonal, so that it can be inverted."""
    share = min(0.5, len(S) / (4.0 * n))
    return (1.0 - share) * S + share * np.diag(np.diag(S))


def heldout(envelopes: Snapshots, plan: Plan, builder: Builder, points: np.ndarray) -> Sets:
    """For each size of held-out faults: points (n, 6 + m), first and second run at the schedule (n, n_omega)."""
    sets: Sets = []
    for k_max in builder.heldout.k_max:
        group = plan.groups[f"heldout {k_max:g}"]
        first, second = np.split(envelopes[group][:, points].astype(float), 2)
        sets.append((plan.x[group][: len(first)], first, second))
    return sets


def switching(nominal: np.ndarray, sets: Sets) -> np.ndarray:
    """Covariance of one run: of the nominal ones about their mean, and of pairs with equal faults about theirs."""
    x = np.vstack([nominal - nominal.mean(axis=0), *[(a - b) / np.sqrt(2.0) for _, a, b in sets]])
    return unbiased(shrunk(x.T @ x / (len(x) - 1), len(x)), len(x))


def model_error(model: Model, sets: Sets, S: np.ndarray) -> np.ndarray:
    """M at each size for few and for many faults, shape (2, number of sets, n_omega, n_omega)."""
    return np.array([[_model_error(model, *pairs, S) for pairs in half] for half in halves(sets)])


def spreads(sets: Sets) -> np.ndarray:
    """Spread up to which faults count as few and from which as many, shape (2,): the mean of the few, and what nine of
    ten of the many exceed."""
    few, many = (np.concatenate([spread(k) for k, _, _ in half]) for half in halves(sets))
    return np.array([few.mean(), max(float(np.quantile(many, 0.1)), few.mean() + 0.1)])


def halves(sets: Sets) -> tuple[Sets, Sets]:
    """The sets' second halves, with few faults, and their first, with many; see `runs.heldout_points`."""
    n = len(sets[0][0]) // 2
    return [(k[n:], a[n:], b[n:]) for k, a, b in sets], [(k[:n], a[:n], b[:n]) for k, a, b in sets]


def _model_error(model: Model, k: np.ndarray, first: np.ndarray, second: np.ndarray, S: np.ndarray) -> np.ndarray:
    """Covariance of the model's error over fault vectors `k` (n, 6), each run twice, shape (n_omega, n_omega).

    Both runs of a pair have the model's error in common and nothing else, so M = E[e₁ e₂ᵀ]. Of its principal
    directions, measured against the switching covariance `S`, those are kept that stand above what chance puts there;
    the others get their mean, in which chance cancels. For weights to be right on average, what is kept counts a
    little more, as a covariance from few samples must (Hartlap et al., A&A 464 (2007) 399).
    """
    L = np.linalg.cholesky(S)
    e1, e2 = (np.linalg.solve(L, (x - model(k)).T) for x in (first, second))
    M = e1 @ e2.T / len(k)
    lam, U = np.linalg.eigh(0.5 * (M + M.T))
    chance = np.sqrt(len(S) / len(k))
    rest = lam[lam <= chance]
    kept = lam > chance
    inflation = len(k) / max(len(k) - kept.sum() - 2, 0.4 * len(k))
    lam = np.where(kept, inflation * lam, max(float(rest.mean()) if rest.size else 0.0, 0.0))
    return np.asarray(L @ (U * lam) @ U.T @ L.T)


def start_influence(
    x: np.ndarray, s: np.ndarray, k: np.ndarray, n_own: np.ndarray, S: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Influence of the start state and the spread it leaves.

    Parameters
    ----------
    x : array, shape (n, n_omega)
        Deviation of the envelope from that of a cold start at the schedule. [A]
    s : array, shape (n, 2)
        Start: user position, gear output θ_m/GR. [rad]
    k : array, shape (n, 6)
        Faults.
    n_own : array, shape (n,)
        Switching covariances that x contains: one of its own, and its share of the cold runs'.
    S : array, shape (n_omega, n_omega)
        Switching covariance. [A²]

    Returns
    -------
    B (n_omega, N_START), covariance of the rest per unit distance² and per ‖k‖² of that (n_omega, n_omega) each,
    scale of the start (2,)
    """
    scale = np.full(2, START_OFFSET)
    F = start_features(s / scale, k)
    size2 = np.sum(k**2, axis=1)
    weighted = F / (1.0 + size2 / KNEE**2)[:, None]  # what is left grows with the faults
    G = F.T @ weighted
    B = np.linalg.solve(G + 1e-3 * np.diag(np.diag(G)), weighted.T @ x).T
    rest = x - F @ B.T
    d2 = np.sum((s / scale) ** 2, axis=1)
    D = np.column_stack([d2, d2 * size2])  # regression of rest restᵀ - S on both
    w = 1.0 / (1.0 + d2 * (1.0 + size2 / KNEE**2)) ** 2  # the larger the spread, the less a run says of it
    excess = np.linalg.solve(
        D.T @ (D * w[:, None]),
        [(rest.T @ (rest * (w * c)[:, None]) - np.sum(w * c * n_own) * S).ravel() for c in D.T],
    ).reshape(2, *S.shape)
    return B, _positive(excess[0]), _positive(excess[1]), scale


def _positive(S: np.ndarray) -> np.ndarray:
    lam, U = np.linalg.eigh(0.5 * (S + S.T))
    return np.asarray((U * np.maximum(lam, 0.0)) @ U.T)
