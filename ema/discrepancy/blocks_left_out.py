"""The uncertainty of coefficients on which blocks of a record disagree, whatever makes them do so."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ema.core.records import Array


def covariance(gram: Array, blocks: Iterable[tuple[Array, Array]], least: float = 1e-12) -> Array:
    """Of least squares, by leaving out one block after the other (one step of Newton's each), shape (n, n).

    Residuals that hang together within a block, and a law that has not quite the right form, count as they show.

    Parameters
    ----------
    gram : array, shape (n, n)
        AᵀA of all rows.
    blocks : pairs of arrays, shapes (n, n) and (n,)
        AᵀA and Aᵀr of the rows of each block, with the residual r.
    least : float
        Share of the largest eigenvalue below which a direction rests on the block that is left out alone.

    References
    ----------
    Bell and McCaffrey, "Bias reduction in standard errors for linear regression with multi-stage samples", Survey
    Methodology 28, 2002 (the jackknife).
    """
    parts = list(blocks)
    n = len(parts)
    if n < 2:
        return np.zeros_like(gram)
    grams, scores = zip(*parts, strict=True)
    others = np.linalg.pinv(gram - np.stack(grams), rcond=least, hermitian=True)  # (n_blocks, n, n), all at once
    moved = (others @ np.stack(scores)[..., None])[..., 0]
    moved -= moved.mean(axis=0)
    return np.asarray(moved.T @ moved * (n - 1) / n)
