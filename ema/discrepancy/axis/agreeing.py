"""Free runs and the balance of torque together: what both name, and what the balance alone shows.

Both judge held-out parts of the same records. Where free runs say little (slow motion, windows of a few samples,
several laws at once) the balance is the sharper test; where a sensor or the electrical side is at fault, it sees
nothing, and free runs decide. A law that the balance alone needs is named where free runs leave a rest, if it is also
missing beside what these found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ema.discrepancy import findings as shared
from ema.discrepancy.plant import Point
from ema.effects import registry
from ema.models.axis_config import LinearAxis

from .balance.as_effects import effects
from .balance.found import Balance, Term
from .balance.telling import INTERVAL, drawn
from .beside import balance_beside
from .linear import in_metres

if TYPE_CHECKING:
    from .plant import AxisPlant

LIKELY = 0.5  # confidence in a law, or those it is not told from, from which it is named where free runs have not
ALONE = " (shown by the balance along the measured motion, not by free runs)"


def together(
    plant: AxisPlant, found: Sequence[shared.FoundEffect], verdict: str, point: Point
) -> tuple[list[shared.FoundEffect], Balance | None]:
    """Effects as free runs found them at `point`, with what the balance says of them, and a balance that adds some."""
    b = plant.balance
    out = list(found)
    for term in b.terms if b is not None else ():
        assert b is not None
        name = _named(b, term)
        own = [k for k, e in enumerate(out) if e.name == name and _is_same(e, effects(b, term)[name])]
        for k in own:
            if out[k].indistinguishable_from:
                continue
            out[k] = replace(out[k], confidence=max(out[k].confidence, round(b.confidence(term), 4)))
    if b is None or verdict in ("adequate", "explained") or not missing(b, out):
        return out, None
    if found:
        b = balance_beside(plant, point)
    added = missing(b, out) if b is not None else []
    if b is None or not added:
        return out, None
    return [*out, *of_balance(plant, b, added)], b


def missing(b: Balance, found: Sequence[shared.FoundEffect]) -> list[Term]:
    """Likely laws that the library has as effects, and that nothing found stands for."""
    told = {name for e in found for name in (e.name, *e.indistinguishable_from)}
    new = [term for term in b.terms if (name := _named(b, term)) and not {name, *term.law.also} & told]
    return [term for term in new if b.of_set(term) >= LIKELY]


def of_balance(plant: AxisPlant, b: Balance, terms: Sequence[Term]) -> list[shared.FoundEffect]:
    """Laws of the balance as effects that were found."""
    return [_effect(plant, b, term, _named(b, term)) for term in terms]


def _named(b: Balance, term: Term) -> str:
    """The effect that acts like a law; empty where the library has none."""
    return next((name for name, values in effects(b, term).items() if values), "")


def _is_same(e: shared.FoundEffect, values: dict[str, float]) -> bool:
    """Of cogging, the same line."""
    order = e.parameters.get("order")
    return order is None or round(order.value) == round(values.get("order", order.value))


def _effect(plant: AxisPlant, b: Balance, term: Term, name: str) -> shared.FoundEffect:
    effect, linear = registry()[name], isinstance(plant.plant, LinearAxis)
    said = in_metres if linear else str
    values = effects(b, term)[name]
    samples = [effects(b, term, c)[name] for c in drawn(b)]
    units = {p.name: said(p.unit) for p in effect.parameters}
    parameters = {}
    for key, value in values.items():
        spread = np.array([s[key] for s in samples])
        if key == "phase":
            spread = value + np.angle(np.exp(1j * (spread - value)))
        low, high = np.percentile(spread, INTERVAL)
        parameters[key] = shared.Quantity(value, float(low), float(high), units[key])
    others = tuple(sorted({*term.alike, *term.law.also}))
    confidence = round(b.of_set(term) / (1 + len(others)), 4)  # those in a set share what is sure of it
    return shared.FoundEffect(
        name, confidence, others, parameters, said(effect.said(values)) + ALONE, effect.separated_by
    )  # fmt: skip
