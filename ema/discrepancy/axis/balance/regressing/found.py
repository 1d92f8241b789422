"""What a regression of the balance found: its laws, how sure each is, and what is left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ema.core.records import Array
from ema.discrepancy.axis.balance.laws.law import BY_RECORD

from .form import of_others

if TYPE_CHECKING:
    from ema.discrepancy.axis.balance.laws.law import Law

    from .agreement import Agreement
    from .regression import Corrected, Plain, Regression


N_DRAWS = 400


@dataclass(frozen=True)
class Term:
    """A law that the records need.

    `power` is the mean square [N² m² or N²] that held-out blocks lose by it, `alike` what does as well, by how often
    it wins over draws of blocks; `wins` how often this law does. `common` is the share that another law of the
    library has on average in common with this one, on these motions: so much of an unknown rest may be taken for it.
    `instead` are fits with one of `alike` in its place, which is the last of their laws. `members` are such fits with
    another member of its family, as the same friction over another way, and how often each leaves least.
    """

    law: Law
    power: float
    wins: float
    alike: dict[str, float]
    common: float
    instead: tuple[Regression, ...] = ()
    members: tuple[tuple[Regression, float], ...] = ()

    @property
    def unseen(self) -> set[str]:
        """Effects that no balance tells from this law, or from what does as well."""
        return {name for law in (self.law, *(r.laws[-1] for r in self.instead)) for name in law.also}

    @property
    def others(self) -> tuple[str, ...]:
        """What this balance cannot tell from the law."""
        return tuple(sorted({*self.alike, *self.unseen} - {self.law.name}))


@dataclass(frozen=True)
class Balance:
    """What a regression of the balance explains.

    Attributes
    ----------
    corrected : Corrected
        Coefficients without what noise in the regressors takes from them, with their covariance.
    drive : float
        Mean square of the drive's torque about its mean. [N² m² or N²]
    left_plain, left_base, left : float
        Mean square left on held-out blocks by the plant file's numbers, with inertia, friction and drag fitted, and
        with the laws found.
    noise : float
        What the sensors' noise leaves.
    agreements : tuple of Agreement
        Where several records are given: each coefficient record by record.
    given : tuple of Law
        What the plant file declares beside inertia, friction and drag: a neighbouring axis.
    creeps : float
        Share of the rows that is left out since friction acts otherwise there than in sliding.
    """

    model: Regression
    corrected: Corrected
    plain: Plain
    terms: tuple[Term, ...]
    drive: float
    left_plain: float
    left_base: float
    left: float
    noise: float
    agreements: tuple[Agreement, ...] = ()
    given: tuple[Law, ...] = ()
    creeps: float = 0.0

    @property
    def travel(self) -> float:
        """Of the motion in the records. [rad or m]"""
        return float(np.ptp(self.model.rows.motion.theta))

    def confidence(self, term: Term) -> float:
        """How often the law wins, times its mark over that and what it may have been taken for.

        That is of the rest, and of the form of other laws. What records contradict each other in counts against it.
        """
        rest = term.common * max(self.left - self.noise, 0.0) + of_others(self, term)
        sure = term.wins * term.power / (term.power + rest) if term.power > 0.0 else 0.0
        return sure * self._agreed(term.law)

    def _agreed(self, law: Law) -> float:
        """Factor on the confidence of a law by what records say of it: 1 where they agree, or may differ."""
        key = law.key.removesuffix(BY_RECORD)
        own = (a for a in self.agreements if a.law is not None and a.law.key.removesuffix(BY_RECORD) == key)
        return min((a.odds for a in own if not a.why), default=1.0)

    def of_set(self, term: Term) -> float:
        """Confidence in a law or one of those that do as well."""
        return min(1.0, self.confidence(term) * (1.0 + sum(term.alike.values()) / max(term.wins, 1e-300)))

    def explained(self, left: float) -> float:
        """Share of the drive's torque, as a coefficient of determination."""
        return 1.0 - left / self.drive


def draw(b: Balance) -> Array:
    """Coefficients drawn from their uncertainty, shape (N_DRAWS, n): also from what the balance cannot tell from a law.

    With another law in the place of one, or another member of its family, as often as it wins, the rest are what they
    are beside that one.
    """
    rng = np.random.default_rng(0)
    out = rng.multivariate_normal(b.corrected.coefficients, b.corrected.covariance, N_DRAWS, method="eigh")
    for k, term in enumerate(b.terms):
        others = [(rival, term.alike[name]) for rival, name in zip(term.instead, term.alike, strict=True)]
        for at, other in (*_draw_others(others, (0, k)), *_draw_others(term.members, (1, k))):
            out[at] += _moved(b.model, other)
    return np.asarray(out)


def draw_law(b: Balance, term: Term) -> list[tuple[Law, Array]]:
    """A law with its coefficients, N_DRAWS times: another member of its family as often as that leaves least."""
    part = b.model.part(term.law)
    own = draw(b)[:, part]
    out = [(term.law, c) for c in own]
    seed = (1, [t.law.key for t in b.terms].index(term.law.key))  # by its place: a copy less sure draws the same
    for at, other in _draw_others(term.members, seed):
        law = other.laws[-1]
        moved = other.coefficients[other.part(law)] - b.model.coefficients[part]
        for k in at:
            out[k] = (law, own[k] + moved)
    return out


def _draw_others(
    others: Sequence[tuple[Regression, float]], seed: tuple[int, int]
) -> list[tuple[NDArray[np.intp], Regression]]:
    """In which of the draws each stands in the place of a law, by its share of them."""
    lots = np.random.default_rng(seed).random(N_DRAWS)
    ends = np.cumsum([0.0, *(share for _, share in others)])
    return [
        (np.flatnonzero((low <= lots) & (lots < high)), r)
        for (r, _), low, high in zip(others, ends[:-1], ends[1:], strict=True)
    ]


def _moved(model: Regression, rival: Regression) -> Array:
    """By how much the coefficients that both have differ; 0 of those that the rival has not."""
    out = np.zeros(len(model.coefficients))
    theirs = {law.key for law in rival.laws}
    for law in model.laws:
        if law.key in theirs:
            out[model.part(law)] = rival.coefficients[rival.part(law)] - model.coefficients[model.part(law)]
    if model.base == rival.base:
        out[: len(model.base)] = rival.coefficients[: len(model.base)] - model.coefficients[: len(model.base)]
    return out
