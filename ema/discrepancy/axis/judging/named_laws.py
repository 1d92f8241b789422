"""Laws of the balance as effects of the library: which are likely and told of nothing yet, with their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ema.discrepancy import findings as shared
from ema.discrepancy.axis.balance.regressing.found import Balance, Term
from ema.discrepancy.axis.balance.telling.as_effects import (
    FITTED,
    beyond_file,
    draw_effects,
    effects,
    friction,
    of_base,
)
from ema.discrepancy.axis.naming.interval import interval
from ema.discrepancy.axis.naming.linear import of_axis, units_of
from ema.discrepancy.form import made_by_form
from ema.discrepancy.grade import NAMED
from ema.discrepancy.rounds import IMMATERIAL
from ema.effects import registry

if TYPE_CHECKING:
    from ema.discrepancy.axis.finding.plant import AxisPlant

ALONE = " (shown by the balance along the measured motion, not by free runs)"


def find_missing(b: Balance, found: Sequence[shared.FoundEffect]) -> list[Term]:
    """Likely laws that the library has as effects, and that nothing found stands for."""
    told = {name for e in found for name in (e.name, *e.indistinguishable_from)}
    new = [term for term in b.terms if (name := name_law(b, term)) and not {name, *term.unseen} & told]
    return [term for term in new if b.of_set(term) >= NAMED]


def name_base(plant: AxisPlant, b: Balance) -> list[shared.FoundEffect]:
    """Inertia and drag that are clearly not the plant file's, where that has them as known.

    As sure as their mark, what they take of the balance, over that, all that is more than noise, and what the form of
    the other may make.
    """
    said, found = partial(of_axis, linear=plant.plant.is_linear), []
    clear = {name: values for name, values in of_base(b).items() if not FITTED[name] & set(plant.plant.fitted)}
    marks = {name: _mark(b, name) for name in clear}
    for name, values in clear.items():
        form = sum(made_by_form(1.0, mark) for other, mark in marks.items() if other != name)
        sure = round(min(marks[name] / max(marks[name] + b.left - b.noise + form, 1e-300), 1.0), 4)
        if sure < NAMED or marks[name] < IMMATERIAL * b.noise:
            continue
        at = b.model.base.index(name)
        ((key, value),) = values.items()
        sd = abs(value / beyond_file(b)[name]) * float(np.sqrt(b.corrected.covariance[at, at]))
        ends = value - shared.WITHIN * sd, value + shared.WITHIN * sd
        effect = registry()[name]
        quantity = shared.Quantity(value, *ends, units_of(effect, said)[key])
        sentence = said(effect.said(values, friction(b))) + ALONE
        found.append(shared.FoundEffect(name, sure, (), {key: quantity}, sentence, said(effect.separated_by)))
    return found


def _mark(b: Balance, name: str) -> float:
    """Mean square that inertia or drag takes of the balance beside all others, for not being the file's."""
    at = b.model.base.index(name)
    own = b.model.beside_others(slice(at, at + 1), b.model.design[:, at])
    return beyond_file(b)[name] ** 2 * float(np.mean(own**2))


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
    samples = [drawn[name] for drawn in draw_effects(b, term) if name in drawn]
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
