"""What the causes that are named leave of an actuator's record, over folds, and the verdict on that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ema.discrepancy.actuator.finding.weighing import is_enough
from ema.discrepancy.actuator.fitting.candidates import Candidate
from ema.discrepancy.actuator.fitting.leave_out import over_folds
from ema.discrepancy.actuator.fitting.model import Model
from ema.discrepancy.actuator.simulating.noise import Verdict as Test
from ema.discrepancy.folds import Folds
from ema.discrepancy.grade import Left, Verdict, grade

if TYPE_CHECKING:
    from ema.discrepancy.actuator.fitting.search import Search


@dataclass(frozen=True)
class Remains:
    """The verdict with what it rests on.

    Attributes
    ----------
    model : Model
        What is told and goes into the extended plant: named causes, and structure without a name that matters.
    error : Folds
        Of the envelope, before anything was added and after `model`. [A]
    left : Left
        What named causes alone leave.
    """

    verdict: Verdict
    model: Model
    error: Folds
    left: Left

    @property
    def is_little(self) -> bool:
        """Whether nothing but named causes is needed."""
        return self.verdict in ("adequate", "explained")


def remains(
    search: Search, before: Model, after: Model, test: Test, nameless: Sequence[Candidate], *, named: bool
) -> Remains:
    """What is left of the record where `after`, less what is `nameless`, is named; or nothing is.

    A line that has no name is left out where nothing more than noise is missed by that.
    """
    search.say("every cycle held out once")
    bare = before if after.effects else after
    told = after if named or nameless else bare
    alone = _without(search, after, nameless) if named else bare
    error, residual = over_folds(search, before, told)
    if alone is told:
        left = Left(test.is_noise and told is after, error, residual, is_enough(told, before))
    else:
        error_alone, residual_alone = over_folds(search, before, alone)
        is_chance = search.verdict(alone).is_noise
        left = Left(is_chance, error_alone, residual_alone, is_enough(alone, before))
    verdict = grade(left, named=named)
    if verdict in ("adequate", "explained") and alone is not told:
        told, error = alone, left.error
    return Remains(verdict, told, error, left)


def _without(search: Search, model: Model, effects: Sequence[Candidate]) -> Model:
    for effect in effects:
        model = search.without(model, effect)
    return model
