"""Whether the rows need a law: is its coefficient more than chance, and does it foretell more of what was held out?

A law beside those that were there is judged by its coefficients. What they are, blocks agree on or not; by how much
they disagree is the error, and p is that of F. That a law acts in a part of the motion only (a pendulum where it
hangs to a side) is no doubt of it, as it would be in a count of the blocks that it helps. Of two laws neither of which
holds the other, the better one is clearly better if it is so over blocks.

References
----------
Vuong, "Likelihood ratio tests for model selection and non-nested hypotheses", Econometrica 57, 1989.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import stats

from ema.core.records import Array
from ema.discrepancy import blocks_left_out
from ema.discrepancy.axis.balance.laws.along import ANY, GEAR_LINE, STIFFENING, TORQUE_LINE, TRAVEL_LINE
from ema.discrepancy.axis.balance.laws.law import BY_RECORD, Law
from ema.discrepancy.axis.balance.laws.links import LINKS
from ema.discrepancy.axis.reading.noise import ESTIMATE_UNCERTAINTY

from .regression import LEAST as ON_ONE_BLOCK
from .regression import Regression

ALARM = 0.01  # probability that chance alone answers a question: whether any law acts, or one beside a certain other
CLEAR = 3.0  # deviations over blocks by which one of two rivals must foretell held-out blocks better
MATTERS = 0.1  # share of what is left that a law must take
LEAST = 3e-4  # share of the drive's torque in power that a law must take, where more is left than it takes
SEEN = 1e-6  # of a column that stands out of those of the other laws

HOLDS = {  # a spring has its own zero
    "spring": ("constant",),
    STIFFENING: ("spring", "constant"),
    ANY: (STIFFENING, "spring", "constant"),
    LINKS: ("pendulum",),
}
SIMPLER = {  # not held, but taken where the larger one is not needed
    STIFFENING: ("pendulum",),
    ANY: ("pendulum", TORQUE_LINE, TRAVEL_LINE, GEAR_LINE),
}


def families_held(family: str) -> tuple[str, ...]:
    """Families that one of another family holds: with own coefficients by record, also those of one for all."""
    shared = family.removesuffix(BY_RECORD)
    own = HOLDS.get(shared, ())
    return own if family == shared else (shared, *own, *(f"{other}{BY_RECORD}" for other in own))


def simpler_families(family: str) -> tuple[str, ...]:
    """Families that are taken in place of another where that is not needed beside them."""
    shared = family.removesuffix(BY_RECORD)
    more = "" if family == shared else BY_RECORD
    return (*families_held(family), *(f"{other}{more}" for other in SIMPLER.get(shared, ())))


@dataclass(frozen=True)
class Asked:
    """What a choice asks: `whole` is the drive's torque in power over all rows, `members` counts laws by family."""

    whole: float
    members: Counter[str] = field(default_factory=Counter)

    @classmethod
    def of(cls, whole: float, every: Iterable[Law]) -> Asked:
        """Of these laws."""
        return cls(whole, Counter(law.family for law in every))

    def level(self, law: Law) -> float:
        """p below which a law is no chance: families share the alarms, and in a family its members."""
        return ALARM / (max(len(self.members), 1) * max(self.members[law.family], 1))


def is_needed(new: Regression, old: Regression, asked: Asked) -> bool:
    """Clearly better, by a share of what is left that matters, and of the drive's torque.

    The latter since no law has quite the right form: beside a rest, what is small may be a part of it. That is no
    doubt of a law that takes most of what is more than noise.
    """
    gain = old.loss - new.loss
    if gain < MATTERS * old.loss or not _is_clear(new, old, asked):
        return False
    noise = float(np.sum(old.rows.sigma[old.rows.whole] ** 2))
    is_seen = old.loss > (1.0 + 2.0 * ESTIMATE_UNCERTAINTY) * noise
    return gain > LEAST * asked.whole or (is_seen and new.loss - noise < 0.5 * gain)


def _is_clear(new: Regression, old: Regression, asked: Asked) -> bool:
    added = [law for law in new.laws if law.key not in {own.key for own in old.laws}]
    gone = [law for law in old.laws if law.key not in {own.key for own in new.laws}]
    if added and all(any(_is_held(law, by) for by in added) for law in gone):
        return chance(new, old, added) < min(asked.level(law) for law in added)
    d = old.losses - new.losses
    votes = d / (old.losses + float(np.mean(old.losses)))  # no block may outvote all others
    return float(votes.sum()) > CLEAR * float(np.sqrt(len(d)) * np.std(votes))


def _is_held(law: Law, by: Law) -> bool:
    return by.repeats.key == law.key if by.repeats is not None else law.family in simpler_families(by.family)


def chance(new: Regression, old: Regression, added: Sequence[Law]) -> float:
    """p that what `added` laws do beside the old model is none: Wald's test by blocks left out, one after the other."""
    q, _ = np.linalg.qr(old.design)
    own: Array = np.column_stack([new.design[:, new.part(law)] for law in added])
    beside = own - q @ (q.T @ own)
    u, s, _ = np.linalg.svd(beside / np.maximum(np.linalg.norm(own, axis=0), 1e-300), full_matrices=False)
    u = u[:, s > SEEN]
    n = u.shape[1]
    if n == 0:
        return 1.0
    A, r = np.column_stack([q, u]), old.left - u @ (u.T @ old.left)
    clusters = [(A[rows], r[rows]) for rows in (old.rows.cluster == k for k in np.unique(old.rows.cluster))]
    V = blocks_left_out.covariance(A.T @ A, ((P.T @ P, P.T @ e) for P, e in clusters), ON_ONE_BLOCK)[-n:, -n:]
    c = u.T @ old.left
    F = float(c @ np.linalg.pinv(V, hermitian=True) @ c) / n
    return float(stats.f.sf(F, n, max(len(clusters) - 1, 1)))
