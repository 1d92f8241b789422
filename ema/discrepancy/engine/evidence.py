"""The evidence of a set of causes: its likelihood integrated over sizes, over subsets of faults and over δ.

About the fitted point the mean is taken for linear, t = μ̂ + J (x - x̂). A size is zero or drawn from a mixture of
normal distributions of several widths (one Gaussian slab against sizes that are uniform in their logarithm costs nine
points of calibration), cut at what is credible. Then all integrals are of Gaussians over boxes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.special import log_ndtr, logsumexp

from .hypothesis import Array, Parameter
from .law_error import SHARES, LawError
from .statistic import Prediction

WIDTHS = (0.25, 1.0, 4.0)  # of the slab, times the usual size
WEIGHTS = (0.25, 0.5, 0.25)
NEGLIGIBLE = 20.0  # [nats] behind the best, from which a term of a sum of some thousands does not count
AT_ONCE = 256  # terms whose share within bounds is integrated at a time
FAULT = 0.3  # prior probability that one fault is there


@dataclass(frozen=True)
class Evidence:
    """Log evidence of one set of causes, what each fault's probability is, and the posterior at its best subset.

    Attributes
    ----------
    log_z : float
        Without the prior of the set.
    p_fault : array, shape (n_faults,)
        Probability that each fault is there.
    mean, sd : arrays, shape (n_faults + n_parameters,)
        Of faults and of the causes' parameters, over all subsets.
    """

    log_z: float
    p_fault: Array
    mean: Array
    sd: Array


def log_mass(low: Array, high: Array) -> Array:
    """log P(low < u < high) of a standard normal u, exact far in its tails."""
    swap = low > 0.0
    a, b = np.where(swap, -high, low), np.where(swap, -low, high)
    upper, lower = log_ndtr(b), log_ndtr(a)
    return np.asarray(upper + np.log1p(-np.exp(np.minimum(lower - upper, -1e-300))))


def log_box(mean: Array, cov: Array, low: Array, high: Array) -> Array:
    """Log probability of a box under normal distributions, by truncating one coordinate after another.

    Mendell and Elston, Biometrics 30, 1974. Coordinates without variance are inside.

    Parameters
    ----------
    mean : array, shape (n, p)
    cov : array, shape (n, p, p)
    low, high : arrays, shape (p,)
    """
    m, V = mean, cov  # of the coordinates that are left
    total = np.zeros(len(m))
    for low_i, high_i in zip(low, high, strict=True):
        column, m_i = V[:, 1:, 0], m[:, 0]
        there = V[:, 0, 0] > 0.0
        sd = np.sqrt(np.where(there, V[:, 0, 0], 1.0))
        m, V = m[:, 1:], V[:, 1:, 1:]
        a, b = (low_i - m_i) / sd, (high_i - m_i) / sd
        log_p = log_mass(a, b)
        if not (log_p[there] < 0.0).any():
            continue  # every term lies within
        total += np.where(there, log_p, 0.0)
        log_a, log_b = -0.5 * (a**2 + np.log(2.0 * np.pi)) - log_p, -0.5 * (b**2 + np.log(2.0 * np.pi)) - log_p
        pdf_a, pdf_b = np.exp(np.minimum(log_a, 50.0)), np.exp(np.minimum(log_b, 50.0))
        shift = pdf_a - pdf_b
        a_pdf, b_pdf = (np.where(pdf > 0.0, np.clip(x, -1e3, 1e3) * pdf, 0.0) for x, pdf in ((a, pdf_a), (b, pdf_b)))
        narrower = np.clip(1.0 + a_pdf - b_pdf - shift**2, 1e-6, 1.0)
        column = column * (there / sd)[:, None]
        m = m + column * shift[:, None]
        V = V - column[:, :, None] * (column * (1.0 - narrower)[:, None])[:, None, :]
    return total


def evidence(
    predictions: Sequence[Prediction],
    columns: Array,
    at: Array,
    faults: Sequence[Parameter],
    causes: Sequence[Sequence[Parameter]],
    law_error: LawError,
    shares: Mapping[float, float] = SHARES,
) -> list[Evidence]:
    """Integrate the likelihood over sizes, subsets of faults and the law error.

    Parameters
    ----------
    predictions : sequence of Predictions
        At the fitted point: estimates of one mean and rest, all of the first one's covariance.
    columns : array, shape (d, n_faults + n_parameters)
        Of t, per unit, at the fitted point.
    at : array, shape (n_faults + n_parameters,)
        The fitted point, less neutral.
    causes : sequence of sequences of Parameters
        Those of each cause; all of a cause are there, with sizes of one width.
    """
    parameters = [*faults, *(p for cause in causes for p in cause)]
    subsets, log_prior, P = _slabs(tuple(p.usual for p in faults), tuple(tuple(p.usual for p in c) for c in causes))
    low, high = (np.array([getattr(p, end) - p.neutral for p in parameters]) for end in ("low", "high"))
    far = 1e6 * (1.0 + np.abs(at))
    low, high = np.maximum(low, -far), np.minimum(high, far)
    prior_mass = np.where(P > 0.0, log_mass(low / np.where(P > 0, P, 1.0), high / np.where(P > 0, P, 1.0)), 0.0)
    prior = log_prior - prior_mass.sum(axis=1)
    b = np.array([columns @ at - prediction.mean for prediction in predictions]).T  # = J u + noise
    found, means, variances = [], [], []
    for share, p_share in shares.items():
        C = predictions[0].covariance + law_error.covariance(share)
        L = cholesky(C, lower=True)
        A, y = (solve_triangular(L, x, lower=True) for x in (columns, b))
        precision = P[:, :, None] * (A.T @ A) * P[:, None, :] + np.eye(len(parameters))
        V = P[:, :, None] * np.linalg.inv(precision) * P[:, None, :]
        mean = V @ (A.T @ y)  # (n, p, n_predictions)
        constant = -0.5 * len(y) * np.log(2.0 * np.pi) - np.log(np.diag(L)).sum()
        gaussian = constant - 0.5 * ((y**2).sum(axis=0) - np.einsum("npk,pk->nk", mean, A.T @ y))
        rest = np.array([prediction.log_rest(law_error.of_rest(share)) for prediction in predictions])
        log_p = prior + np.log(p_share) - 0.5 * np.linalg.slogdet(precision)[1]
        found.append(gaussian + log_p[:, None] + rest)
        means.append(mean)
        variances.append(V)
    log_z, u, cov = np.concatenate(found), np.concatenate(means), np.concatenate(variances)
    there = np.tile(subsets, (len(shares), 1))
    return [_summed(log_z[:, k], u[:, :, k], cov, there, low, high) for k in range(len(predictions))]


def _summed(log_z: Array, mean: Array, cov: Array, there: Array, low: Array, high: Array) -> Evidence:
    """The sum over terms: Gaussians of log evidence, mean and covariance, with faults that are there, within bounds."""
    log_z = _within(log_z, mean, cov, low, high)
    total = float(logsumexp(log_z))
    counts = log_z > -np.inf
    weight = np.exp(log_z[counts] - total)
    u = np.clip(mean[counts], low, high)
    expected = weight @ u
    var = np.diagonal(cov[counts], axis1=1, axis2=2)
    sd = np.sqrt(np.maximum(weight @ (var + u**2) - expected**2, 0.0))
    return Evidence(total, weight @ there[counts], expected, sd)


def _within(log_z: Array, mean: Array, cov: Array, low: Array, high: Array) -> Array:
    """Log evidence of terms with the share that lies within bounds.

    That share only takes: terms too far behind the best to count are left out before theirs is integrated.
    """
    order = np.argsort(-log_z)
    found = np.full(len(log_z), -np.inf)
    for first in range(0, len(order), AT_ONCE):
        at = order[first : first + AT_ONCE]
        if log_z[at[0]] < found.max() - NEGLIGIBLE:
            break
        found[at] = log_z[at] + log_box(mean[at], cov[at], low, high)
    return found


@lru_cache(maxsize=64)
def _slabs(faults: tuple[float, ...], causes: tuple[tuple[float, ...], ...]) -> tuple[Array, Array, Array]:
    """Subsets of faults (n, n_faults), log prior (n,), standard deviations of all parameters (n, p) by term.

    Of the usual sizes of faults, and of each cause's parameters.
    """
    subsets, log_prior, P = [], [], []
    usual = np.array(faults)
    for there in product((0.0, 1.0), repeat=len(faults)):
        any_fault = any(there)
        for fault_width, *widths in product(
            range(len(WIDTHS)) if any_fault else (0,), *([range(len(WIDTHS))] * len(causes))
        ):
            weight = np.log(WEIGHTS[fault_width]) if any_fault else 0.0
            weight += sum(np.log(WEIGHTS[w]) for w in widths)
            n = sum(there)
            weight += n * np.log(FAULT) + (len(faults) - n) * np.log1p(-FAULT)
            sizes = [WIDTHS[w] * size for w, cause in zip(widths, causes, strict=True) for size in cause]
            subsets.append(there)
            log_prior.append(weight)
            P.append([*(WIDTHS[fault_width] * usual * there), *sizes])
    return np.array(subsets), np.array(log_prior), np.array(P)
