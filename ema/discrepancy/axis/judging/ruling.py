"""The verdict by the balance of torque, where free runs cannot say.

They know no neighbouring axis, and of an axis that creeps between its moves friction in sliding only, unless they found
what it does before it slides and leave little more than noise: where they miss much of its motion, or leave it
unexplained and more times the noise than the balance does beside the creeping, that one rules. It rules, too, where
they miss much of the motion and leave more times the noise: what is named there is the best of what does not fit. And
where noise alone makes much of the motion in a free run, and they are as good with a law as without it, they are no
witness against what the balance sees: the verdict is then its own, of held-out blocks of torque, and says so. A balance
that sees nothing does not rule out a torque without a name by which they follow the motion. Where they follow the
motion to within little and leave noise, the record is adequate whatever small thing the balance holds on to: it smooths
what is shorter than its test functions, as the end of a reversal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ema.core.records import Array
from ema.discrepancy import findings as shared
from ema.discrepancy.axis.balance.laws.law import Law
from ema.discrepancy.axis.balance.laws.links import COUPLED
from ema.discrepancy.axis.balance.regressing.found import Balance, Term
from ema.discrepancy.axis.balance.regressing.needed import ALARM, chance
from ema.discrepancy.axis.balance.regressing.regression import regress
from ema.discrepancy.axis.balance.telling.as_effects import effects, point
from ema.discrepancy.axis.balance.telling.telling import of_given
from ema.discrepancy.folds import Folds
from ema.discrepancy.grade import NAMED, UNSOLVED, UPPER, Left
from ema.discrepancy.outcome import Outcome
from ema.effects import registry

from .named_laws import find_missing, name_base, name_laws

if TYPE_CHECKING:
    from ema.discrepancy.axis.finding.plant import AxisPlant

WORSE = 0.1  # of the mean square of the free runs' residual, that a law may add to it and not be refuted by them
WITNESS = 0.1  # of the motion, that free runs which are a witness may miss, or noise make in them
NEIGHBOUR = "they know nothing of the neighbouring axis"
CREEPS = "the axis creeps in {:.0%} of the motion, with friction that is not that of sliding, which is all they know"
MISSES = "they miss {:.0%} of the motion, and the balance leaves fewer times the noise"
BLIND = "noise makes {:.0%} of the motion in them, and they are no worse with what the balance names than without"


@dataclass(frozen=True)
class Ruling:
    """What the balance says in place of free runs, and why it does."""

    effects: list[shared.FoundEffect]
    left: Left
    why: str

    @property
    def rest(self) -> float:
        """How many times the noise is left in the balance; 0 where that is chance."""
        return 0.0 if self.left.is_chance else self.left.residual.rest

    @property
    def note(self) -> str:
        """For the reader of the verdict."""
        return f"the verdict and the gain are of the balance of torque, not of free runs: {self.why}"


def rule_by_balance(plant: AxisPlant, outcome: Outcome) -> Ruling | None:
    """The balance's own verdict; None where free runs can say, or where there is no balance."""
    b = plant.balance
    if b is None:
        return None
    if b.given:
        sure = _share_of_rest(b, b.given[0]) if _is_seen(b) else 0.0
        own = [_of_neighbour(b, b.given[0], sure)] if sure >= NAMED else []
        own += [_of_neighbour(b, t.law, b.of_set(t)) for t in b.terms if t.law.name == COUPLED and b.of_set(t) >= NAMED]
        return Ruling([*own, *name_laws(plant, b, find_missing(b, []))], _measure_left(plant, b), NEIGHBOUR)
    left, missing = _measure_left(plant, b), find_missing(b, [])
    why = _why_it_rules(plant, outcome, b, left, missing)
    return Ruling([*name_base(plant, b), *name_laws(plant, b, missing)], left, why) if why else None


def _why_it_rules(plant: AxisPlant, outcome: Outcome, b: Balance, left: Left, missing: Sequence[Term]) -> str:
    """What keeps free runs from being a witness against the balance, in words; empty where nothing does."""
    missed = outcome.folds.err_after
    unsolved = outcome.verdict in UNSOLVED
    is_closer = unsolved and left.residual.rest < outcome.left.residual.rest
    leave_little = outcome.left.residual.rest <= outcome.left.allowed
    if not missing and outcome.structure and outcome.rest <= outcome.left.allowed:
        return ""  # what sees nothing is no witness against a torque by which free runs follow the motion
    if b.creeps and not (_know_creeping(outcome) and leave_little) and (missed > WITNESS or is_closer):
        return CREEPS.format(b.creeps)
    if missed > WITNESS and is_closer and not leave_little:
        return MISSES.format(missed)
    is_blind = outcome.verdict == "adequate" and outcome.folds.noise_floor > WITNESS
    if is_blind and missing and not _is_refuted(plant, outcome, b):
        return BLIND.format(outcome.folds.noise_floor)
    return ""


def gain(plant: AxisPlant, b: Balance, left: Left, outcome: Outcome) -> shared.Gain:
    """The gain as the balance has it."""
    folds, linear = left.error, plant.plant.is_linear
    numbers = point(b, linear=linear)
    return shared.Gain(
        folds.err_before,
        float(np.sqrt(np.mean(b.model.left**2) / b.drive)),
        folds.err_before,
        folds.err_after,
        folds.noise_floor,
        tuple(outcome.k_before),
        tuple(numbers.get(name, k) for name, k in zip(outcome.base, outcome.k_after, strict=True)),
        k_names=tuple(outcome.base),
        what=f"held-out error of the balance over the drive's {'force' if linear else 'torque'}",
        scale=100.0,
        unit="%",
        folds=folds,
        residual=folds,
    )


def _know_creeping(outcome: Outcome) -> bool:
    """Whether free runs found what friction does before it slides."""
    return any(registry()[e["name"]].acts_at_rest for e in outcome.effects if e["name"] in registry())


def _measure_left(plant: AxisPlant, b: Balance) -> Left:
    """What the balance leaves of held-out blocks, over the drive's torque."""
    rows = b.model.rows
    before = (rows.y - b.plain.inertia * rows.alpha) ** 2
    parts = [own for k in range(rows.n_blocks) if (own := np.flatnonzero(rows.whole & (rows.block == k))).size]

    def of(squares: Array) -> tuple[float, ...]:
        return tuple(float(np.mean(squares[own]) / b.drive) for own in parts)

    names, weight = tuple(f"block {k + 1}" for k in range(len(parts))), tuple(float(own.size) for own in parts)
    folds = Folds(names, of(before), of(b.model.held_out**2), of(rows.sigma**2), weight)
    scatter = folds.relative_rest_error
    unsure = max(scatter if np.isfinite(scatter) else 0.0, plant.noise_uncertainty)
    return Left(folds.rest <= np.exp(UPPER * unsure), folds, folds, noise_uncertainty=plant.noise_uncertainty)


def _is_seen(b: Balance) -> bool:
    """Whether the declared neighbour does anything."""
    without = regress(b.model.rows, b.plain, [law for law in b.model.laws if law not in b.given])
    return chance(b.model, without, b.given) < ALARM


def _share_of_rest(b: Balance, law: Law) -> float:
    """How sure the declared neighbour is: its mark over that and what is more than noise."""
    without = regress(b.model.rows, b.plain, [own for own in b.model.laws if own is not law])
    mark = (without.loss - b.model.loss) / max(int(b.model.rows.whole.sum()), 1)
    return max(mark, 0.0) / max(mark + b.left - b.noise, 1e-300)


def _of_neighbour(b: Balance, law: Law, sure: float) -> shared.FoundEffect:
    """What the neighbour does to this axis as a cause, of which the axis model knows nothing."""
    told = of_given(b, law)
    return shared.FoundEffect(
        told["name"],
        round(min(sure, 1.0), 4),
        (),
        {name: shared.Quantity(**q) for name, q in told["parameters"].items()},
        told["sentence"],
        law.separated_by,
        in_every_record=False,
    )


def _is_refuted(plant: AxisPlant, outcome: Outcome, b: Balance) -> bool:
    """Whether free runs with the balance's laws and numbers leave more than without."""
    if not all(effects(b, term) for term in b.terms):
        return True
    blocks = range(len(plant.blocks))
    numbers = {**outcome.point, **point(b, linear=plant.plant.is_linear)}
    here, there = (
        float(np.mean(np.concatenate([np.clip(r, -20.0, 20.0).ravel() ** 2 for r in plant.residuals([p], blocks)[0]])))
        for p in (outcome.point, numbers)
    )
    return there > here * (1.0 + WORSE)
