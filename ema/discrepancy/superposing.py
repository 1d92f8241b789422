"""Sets of effects that explain more together than what was found one by one, from what each of them does alone.

Forward selection begins with the effect that explains most alone. Where two make the record, a third that does what
they have in common may come first, and either of them then adds little.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from ema.core.records import Array

from .fitting import Fit, flatten, jacobian
from .plant import Plant

REACH = 10.0  # times what it is alone, up to which an effect is taken as linear
NOTHING = 1.0  # square of what an effect does to a white residual, over all samples: half a nat
RIDGE = 1e-9  # of each effect's own square: two that do the same have no amplitudes of their own


def rank_sets(
    plant: Plant, before: Sequence[Fit], trials: Mapping[str, Sequence[Fit]], most: int
) -> list[tuple[float, tuple[str, ...]]]:
    """Sets of two to `most` effects with the mean square that they should leave, the best first.

    What each did to the model `before` is superposed, with amplitudes and that model's parameters by least squares: no
    simulation but those for slopes. `before` are its fits by fold, `trials` those with one effect more, by key.
    """
    keys = list(trials)
    sets = [c for n in range(2, most + 1) for c in combinations(range(len(keys)), n)]
    left = np.zeros(len(sets))
    n_rows = 0
    for k, own in enumerate(before):
        here = flatten(own.residuals)
        known, _ = np.linalg.qr(jacobian(plant, own.free, own.point, own.blocks, here))
        marks = np.array([_mark(plant, own, trials[key][k], here) for key in keys])
        marks -= (marks @ known) @ known.T
        rest = here - known @ (known.T @ here)
        left += _least(marks @ marks.T, marks @ rest, float(rest @ rest), sets)
        n_rows += len(here)
    order = np.argsort(left, kind="stable")
    return [(float(left[j]) / n_rows, tuple(keys[i] for i in sets[j])) for j in order if np.isfinite(left[j])]


def _mark(plant: Plant, before: Fit, own: Fit, here: Array) -> Array:
    """What an effect does to the residual: as fitted, or at its start where by itself it does nothing.

    A supply does not sag by less than nothing, and by itself it may have to where a magnet is weak too.
    """
    mark = flatten(own.residuals) - here
    if mark @ mark > NOTHING:
        return mark
    begun = {f.name: f.start for f in own.free if f.name not in before.point}
    (at_start,) = plant.residuals([{**own.point, **before.point, **begun}], before.blocks)
    return flatten(at_start) - here


def _least(products: Array, with_residual: Array, square: float, sets: Sequence[tuple[int, ...]]) -> Array:
    """The least square that each set leaves; infinite where amplitudes go beyond `REACH`."""
    out = np.full(len(sets), np.inf)
    sizes = np.array([len(s) for s in sets])
    for n in np.unique(sizes):
        which = np.flatnonzero(sizes == n)
        of = np.array([sets[int(j)] for j in which])
        A = products[of[:, :, None], of[:, None, :]]
        b = with_residual[of]
        A = A + RIDGE * np.maximum(A.diagonal(axis1=1, axis2=2), square)[:, :, None] * np.eye(n)
        x = -np.linalg.solve(A, b[:, :, None])[:, :, 0]
        out[which] = np.where(np.all(np.abs(x) < REACH, axis=1), square + np.sum(x * b, axis=1), np.inf)
    return out
