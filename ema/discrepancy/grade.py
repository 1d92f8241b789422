"""The verdict: what is claimed of an answer, from what it leaves.

A verdict against the simulation needs two things. What is left is no chance, which a calibrated test of the record
says; and it is more than `LIMIT` times what noise makes, which held-out parts say. A test alone sees what is smaller
than the noise; an error alone may be chance. Where the noise itself was estimated from the record, it may be larger
than that: "within" then means within `LIMIT` times the most that it may be. "Explained" claims something, and its error
is held against the estimate.

=========================  =================================================  ==================================
what the test of all says  what is left of held-out parts                     no cause named  /  causes named
=========================  =================================================  ==================================
noise                      error within `LIMIT`                               adequate        /  explained
noise                      error beyond                                       adequate        /  partly explained
not noise                  error and residual within `LIMIT`                  adequate, note  /  explained, note
not noise                  error within; residual beyond, no more than the    unexplained     /  explained, note
                           form of the laws that are named may leave
not noise                  error beyond by no more than parts scatter,        adequate, note  /  partly explained
                           residual within
not noise                  anything else, and whatever else where one part    unexplained     /  partly explained
                           stands alone far beyond all others (`event`)
=========================  =================================================  ==================================
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from .folds import Folds

Verdict = Literal["adequate", "explained", "partly explained", "unexplained", "unfinished"]
UNSOLVED: tuple[Verdict, ...] = ("partly explained", "unexplained")  # more is left than noise may make
UPPER = 1.645  # deviations, that an estimate exceeds with a probability of 5 %
IN_SET = 0.05  # share of what is sure of a set, below which a member is none: the others are a set of 95 %
NAMED = 0.5  # probability of an effect with all that the data cannot tell from it, from which it is named
LIMIT = 1.2  # times what noise makes of held-out parts, beyond which a record is not explained


@dataclass(frozen=True)
class Left:
    """What the causes that are named leave; what was fitted without a name counts as left.

    Attributes
    ----------
    is_chance : bool
        A test of the whole record finds nothing but noise.
    error : Folds
        Errors in the plant's own unit, of parts that were held out.
    residual : Folds
        The same of the residual weighed by its noise, which sees more.
    is_form : bool
        No more is left of the residual than laws of another form may leave.
    noise_uncertainty : float
        Relative standard deviation of the noise's amplitude; 0 where it is known.
    """

    is_chance: bool
    error: Folds
    residual: Folds
    is_form: bool = False
    noise_uncertainty: float = 0.0

    @property
    def allowed(self) -> float:
        """How many times the estimated noise may be left before a rest is sure."""
        return LIMIT * (1.0 + UPPER * self.noise_uncertainty)

    @property
    def is_sure(self) -> bool:
        """Whether more is left than noise makes: of the residual, or of the error by more than its parts scatter.

        The residual is weighed by its noise, so that each part counts for what it can tell, and one alone that leaves
        far more than all others is sure. The error in the plant's own unit is not: of free runs one part may make most
        of it.
        """
        error = self.error.least_rest(UPPER)
        return bool(self.residual.rest > self.allowed or error > self.allowed or self.residual.event is not None)

    @property
    def event(self) -> str:
        """What one part leaves far more of than all others, in words; empty where none does.

        It happened once where the others leave what noise makes; else it is in them too, and strongest there.
        """
        if self.is_chance or self.residual.event is None:
            return ""
        name, rest, others = self.residual.event
        what = (
            "something happened there that is not in the rest of the record (a slip, a blow, a disturbed signal)"
            if others <= self.allowed
            else "what is missing is in the others too, and most of it there"
        )
        return f"{name} leaves {rest:.3g} times the noise, every other part at most {others:.3g}: {what}"

    @property
    def sentence(self) -> str:
        """How much is left where it is not noise, in words."""
        return (
            f"a test of the whole record still sees what is no chance: held out one by one, {len(self.error.names)} "
            f"parts leave {self.error.told_rest} times the noise in their error and {self.residual.told_rest} times in "
            "the residual weighed by its noise"
        )


def grade(left: Left, *, named: bool) -> Verdict:
    """The verdict on what `left` says, with causes `named` or without any."""
    if not named:
        return "adequate" if left.is_chance or not left.is_sure else "unexplained"
    is_little = left.is_chance or (not left.event and (left.is_form or left.residual.rest <= left.allowed))
    return "explained" if is_little and left.error.rest <= LIMIT else "partly explained"
