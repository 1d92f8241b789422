"""From features to a few statistics: whitening, projection on what candidates can move, and the rest as one number."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.stats import gamma

if TYPE_CHECKING:
    from .hypothesis import Array, Block
    from .records import Simulated

RECORDS_PER_DIRECTION = 3  # simulated records for each statistic whose covariance they tell
FLAT = 1e-10  # of the largest variance, below which there is none
FAINT = 1e-2  # length of a direction over the longest, below which no candidate moves it apart from others


def shrinkage(z: Array) -> float:
    """Weight of the diagonal in the estimate of a correlation matrix from standardised rows z (n, d).

    λ = Σ Var(r_ij) / Σ r_ij²  over i ≠ j  (Schäfer and Strimmer, Stat. Appl. Genet. Mol. Biol. 4, 2005).
    """
    n, d = z.shape
    if d == 1:
        return 0.0
    squares = z**2  # sums over all pairs i, j by the products of rows, of which there are few
    second = float((squares.sum(axis=1) ** 2).sum() - (squares**2).sum()) / (n - 1)
    r = (float(((z @ z.T) ** 2).sum()) - float((squares.sum(axis=0) ** 2).sum())) / (n - 1) ** 2
    return float(np.clip((second - r) / n / max(r, 1e-300), 0.02, 1.0))


def shrunk_correlation(z: Array) -> Array:
    """Correlation matrix of standardised rows z (n, d), positive definite however few they are."""
    r = (1.0 - shrinkage(z)) * (z.T @ z / len(z))
    np.fill_diagonal(r, 1.0)
    return np.asarray(r)


@dataclass(frozen=True)
class Root:
    """The symmetric root of the inverse of a `shrunk_correlation`, by its few directions beside the unit matrix.

    Attributes
    ----------
    directions : array, shape (n_features, n)
        Orthonormal: those in which the rows differ that it is made of.
    along, across : array (n,), float
        What the root multiplies by along each of them, and across all.
    """

    directions: Array
    along: Array
    across: float

    @classmethod
    def of(cls, z: Array) -> Root:
        """From standardised rows (n, n_features)."""
        own = shrinkage(z)
        variance, rows = np.linalg.eigh(z @ z.T / len(z))
        kept = variance > FLAT * variance[-1]
        variance, rows = variance[kept], rows[:, kept]
        directions = z.T @ rows / np.sqrt(len(z) * variance)
        return cls(directions, 1.0 / np.sqrt(own + (1.0 - own) * variance), 1.0 / np.sqrt(own))

    def __call__(self, x: Array) -> Array:
        """Whitened rows of standardised `x`, shape (..., n_features)."""
        along = x @ self.directions
        return np.asarray(self.across * x + (along * (self.along - self.across)) @ self.directions.T)

    @property
    def inverse(self) -> Root:
        """What makes standardised rows of whitened ones."""
        return Root(self.directions, 1.0 / self.along, 1.0 / self.across)


@dataclass(frozen=True)
class Whitening:
    """Standard deviations (n_features,) and what whitens each kind of block; made of the runs of `seeds`."""

    sd: Array
    roots: Mapping[int, Callable[[Array], Array]]
    blocks: tuple[Block, ...]
    seeds: range

    def white(self, x: Array) -> Array:
        """Rows (..., n_features) in units of noise."""
        z = np.atleast_2d(x / self.sd)
        out = np.empty_like(z)
        for at, kind in self.blocks:
            out[:, at] = self.roots[kind](z[:, at])
        return np.asarray(out.reshape(np.shape(x)))


@dataclass(frozen=True)
class Statistic:
    """Projection of whitened features on the span of columns.

    Attributes
    ----------
    whitening : Whitening
    basis : array, shape (n_features, d)
        Orthonormal.
    """

    whitening: Whitening
    basis: Array

    @classmethod
    def of(cls, whitening: Whitening, columns: Array, n_records: int) -> Statistic:
        """On the directions that whitened `columns` (n_features, n_columns) reach, strongest first.

        No more than the covariance of `n_records` simulated records can be told for.
        """
        length = np.linalg.norm(columns, axis=0)
        unit = columns[:, length > 0.0] / length[length > 0.0]
        u, s, _ = np.linalg.svd(unit, full_matrices=False)
        d = min(int((s > FAINT * s[0]).sum()), n_records // RECORDS_PER_DIRECTION) if len(s) else 0
        return cls(whitening, u[:, :d])

    def by_block(self, x: Array) -> Array:
        """What each block of features (n, n_features) adds to the statistics, (n, n_blocks, d)."""
        white = self.whitening.white(x)
        return np.stack([white[:, block.at] @ self.basis[block.at] for block in self.whitening.blocks], axis=1)

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """Statistics t (..., d) of features (..., n_features), and their squared rest (...)."""
        white = self.whitening.white(x)
        t = white @ self.basis
        return t, np.maximum((white**2).sum(axis=-1) - (t**2).sum(axis=-1), 0.0)


@dataclass(frozen=True)
class Prediction:
    """What a hypothesis foretells of the statistics of a record.

    Attributes
    ----------
    mean : array, shape (d,)
        Of t, less that of the record: the residual with its sign turned.
    covariance : array, shape (d, d)
        Of one record, with the share of a mean of N.
    rest : float
        Squared rest of the record about the predicted mean, less what the mean's own noise makes of it.
    rest_mean, rest_variance : float
        Of records of the hypothesis itself.
    """

    mean: Array
    covariance: Array
    rest: float
    rest_mean: float
    rest_variance: float

    @classmethod
    def of(cls, statistic: Statistic, records: Simulated, measured: Array) -> Prediction:
        """From simulated records that the whitening has not seen; else OwnRecordsError."""
        records.refuse_shared(statistic.whitening.seeds)
        n = len(records.features)
        unbiased = n / (n - 1.0)
        centre = records.features.mean(axis=0)
        own = statistic(records.features - centre)[1]
        mean, rest = statistic(centre - measured)
        rest_mean = unbiased * float(own.mean())
        left = max(float(rest) - rest_mean / n, 1e-9)
        rest_variance = unbiased**2 * float(own.var(ddof=1))
        return cls(mean, _covariance(statistic, records), left, rest_mean, rest_variance)

    def log_rest(self, law_error: float) -> float:
        """Log density of the rest: a gamma as wide as the records', stretched by what a law may leave of it.

        Less than the likeliest counts as that: records hold what honest simulations may differ by at most.
        """
        stretch = 1.0 + law_error / self.rest_mean
        scale = self.rest_variance / self.rest_mean
        shape = self.rest_mean / scale
        likeliest = max(shape - 1.0, 0.0) * scale * stretch
        return float(gamma.logpdf(max(self.rest, likeliest), shape, scale=scale * stretch))


def _covariance(statistic: Statistic, records: Simulated) -> Array:
    """Covariance of what one record differs from the mean of all by, (d, d).

    What is random differs from block to block: covariances of blocks add, and few records tell them. The inverse of a
    shrunk correlation is not too large, as that of a sample's own is: it takes no factor for its few rows. What a grid
    of integration makes is the same in all blocks, and no record tells its grid.
    """
    grids = [records.features[records.grid == g] for g in range(records.grids)]
    means = np.array([x.mean(axis=0) for x in grids])
    away = [np.sqrt(len(x) / (len(x) - 1.0)) * (x - m) for x, m in zip(grids, means, strict=True)]
    parts = statistic.by_block(np.concatenate(away))
    n, n_blocks, d = parts.shape
    rows = parts.reshape(-1, d)
    sd = np.sqrt((rows**2).mean(axis=0))
    random = n_blocks * shrunk_correlation(rows / sd) * np.outer(sd, sd)
    if records.grids == 1:
        return np.asarray((1.0 + 1.0 / n) * random)
    t = statistic(means - means.mean(axis=0))[0]
    between = t.T @ t / (records.grids - 1.0)
    L = cholesky(random, lower=True)
    w, V = np.linalg.eigh(solve_triangular(L, solve_triangular(L, between, lower=True).T, lower=True))
    own = np.maximum(w - records.grids / n, 0.0)  # less what is random in the means
    of_grid = L @ (V * own) @ V.T @ L.T
    return np.asarray((1.0 + 1.0 / n) * random + (1.0 + 1.0 / records.grids) * of_grid)
