"""Columns that agree with what was simulated at several points of one hypothesis.

A column is a difference over a short step. In a direction that a record hardly feels it is mostly noise, and noise is
as long as a response: it says that the direction is felt. Points of one hypothesis lie far apart just there, and what
was simulated at them tells what lies between [Broyden, Math. Comp. 19, 1965].
"""

from __future__ import annotations

import numpy as np
from scipy.stats import f

from .hypothesis import Array

CHANCE = 0.01  # probability that noise differs as much from what columns say, from which they are believed
APART = 1e-6  # spread of points along a direction over the widest, below which it is none


def learn_from(columns: Array, points: Array, means: Array) -> Array:
    """The columns (d, p), changed where between points they say what noise cannot have hidden.

    Parameters
    ----------
    columns : array, shape (d, p)
        Per unit of each parameter.
    points : array, shape (m, p)
    means : array, shape (2, m, d)
        Simulated there, by either half of the seeds: noise differs between the halves, and their product has no share
        of it.
    """
    d = len(columns)
    length = np.linalg.norm(columns, axis=0)
    scale = np.where(length == 0.0, 1.0, length)
    along, spread, ways = np.linalg.svd((points - points.mean(axis=0)) * scale, full_matrices=False)
    J, change = columns / scale, np.zeros_like(columns)
    for u, s, way in zip(along.T, spread, ways, strict=True):
        if s <= APART * spread[0]:
            break
        first, second = u @ (means - means.mean(axis=1, keepdims=True))
        told, of_noise, said = 0.5 * (first + second), 0.5 * (first - second), s * ((J + change) @ way)
        if (told - said) @ (told - said) <= (of_noise @ of_noise) * float(f.isf(CHANCE, d, d)):
            continue
        response = float(np.clip(first @ second / (told @ told), 0.0, 1.0))  # the rest of its length is noise
        change += np.outer(response * told - said, way) / s
    return np.asarray(columns + change * scale)
