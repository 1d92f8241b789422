"""A fitted model of effects and faults, and the measures by which models are told apart."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ema.core.names import FAULTS

from .free import K_FREE

if TYPE_CHECKING:
    from ema.discrepancy.actuator.simulating.noise import Noise
    from ema.discrepancy.plant import Point

    from .candidates import Candidate, Way
    from .fit import Fit
    from .free import Free

N_FINAL = 16  # seeds of a mean that is judged
FINAL_SEED = 3_000_000
N_GLANCE, N_GLANCE_FAR = 4, 2  # seeds that tell a good start from a bad one; where a hundred times their noise is left
K_SEEN = 0.01  # a fault that is there
CHANCE = 0.03  # difference in misfit that seeds make
FAR = 100.0  # excess from which candidates are simulated before they are ranked
NEAR = 1.0  # excess up to which noise may hide what a fit has found, and what is flat counts
DISTANT = 10.0  # excess of a model that is far from the data
MAX_EFFECTS = 3  # that are looked for


@dataclass
class Model:
    """A fitted model and how it does on held-out cycles.

    `heldout` is the sum of squares over what noise makes of it: one where nothing is left to explain.
    """

    effects: tuple[Candidate, ...]
    fit: Fit
    heldout: float
    by: Noise | None = None  # the noise that `heldout` is measured by

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(c.effect for c in self.effects)

    @property
    def is_full(self) -> bool:
        """Whether it has as many effects as are looked for; a second line is no further cause."""
        return len(set(self.names) - {"torque_line"}) >= MAX_EFFECTS

    @property
    def excess(self) -> float:
        """What is left on held-out cycles beyond noise."""
        return max(self.heldout - 1.0, 0.0)

    def shows_faults_of(self, effect: Candidate) -> bool:
        """Whether all of the several faults that an effect can be mistaken for are seen."""
        faults = effect.faults
        return len(faults) > 1 and all(self.fit.point.get(name, 0.0) > K_SEEN for name in faults)


def ways_of(model: Model) -> frozenset[Way]:
    """The effects of a model and how they act."""
    return frozenset(c.way for c in model.effects)


def strip(model: Model, *gone: Candidate) -> tuple[tuple[Candidate, ...], tuple[Free, ...], Point]:
    """Effects, free parameters and point of a model without some of its effects."""
    own, names = {f.name for c in gone for f in c.frees}, {c.effect for c in gone}
    point = {name: x for name, x in model.fit.point.items() if name.split(".")[0] not in names}
    effects = tuple(c for c in model.effects if c not in gone)
    return effects, tuple(f for f in model.fit.free if f.name not in own), point


def free_again(frees: tuple[Free, ...], effect: Candidate) -> tuple[Free, ...]:
    """Free parameters with the faults that `effect` may have stood for: a model with it may do without them."""
    there = {f.name for f in frees} | set(effect.faults)
    return (*(f for f in K_FREE if f.name in there), *(f for f in frees if f.name not in FAULTS))
