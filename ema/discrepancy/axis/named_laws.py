"""Laws of the balance as effects of the library: which are likely and told of nothing yet, with their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from ema.discrepancy import findings as shared
from ema.discrepancy.grade import NAMED
from ema.effects import registry

from .balance.as_effects import draw_effects, effects, friction
from .balance.found import Balance, Term
from .interval import interval
from .linear import of_axis, units_of

if TYPE_CHECKING:
    from .plant import AxisPlant

ALONE = " (shown by the balance along the measured motion, not by free runs)"


def find_missing(b: Balance, found: Sequence[shared.FoundEffect]) -> list[Term]:
    """Likely laws that the library has as effects, and that nothing found stands for."""
    told = {name for e in found for name in (e.name, *e.indistinguishable_from)}
    new = [term for term in b.terms if (name := name_law(b, term)) and not {name, *term.unseen} & told]
    return [term for term in new if b.of_set(term) >= NAMED]


def name_laws(plant: AxisPlant, b: Balance, terms: Sequence[Term]) -> list[shared.FoundEffect]:
    """Laws of the balance as effects that were found."""
    return [_effect(plant, b, term, name_law(b, term)) for term in terms]


def name_law(b: Balance, term: Term) -> str:
    """The effect that acts like a law; empty where the library has none."""
    return next((name for name, values in effects(b, term).items() if values), "")


def _effect(plant: AxisPlant, b: Balance, term: Term, name: str) -> shared.FoundEffect:
    effect, linear = registry()[name], plant.plant.is_linear
    said = partial(of_axis, linear=linear)
    values = effects(b, term)[name]
    samples = [drawn[name] for drawn in draw_effects(b, term)]
    units = units_of(effect, said)
    parameters = {
        key: shared.Quantity(value, *interval(key, value, [s[key] for s in samples]), units[key])
        for key, value in values.items()
    }
    others = term.others
    confidence = round(b.of_set(term) / (1 + len(others)), 4)  # those in a set share what is sure of it
    return shared.FoundEffect(
        name, confidence, others, parameters, said(effect.said(values, friction(b))) + ALONE, said(effect.separated_by)
    )  # fmt: skip
