"""Free runs and the balance of torque together: what both name, and what the balance alone shows.

Both judge held-out parts of the same records. Where free runs say little (slow motion, windows of a few samples,
several laws at once) the balance is the sharper test; where a sensor or the electrical side is at fault, it sees
nothing, and free runs decide. A law that the balance alone needs is named where free runs leave a rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ema.discrepancy import findings as shared
from ema.effects import registry
from ema.models.axis_config import LinearAxis

from .balance.as_effects import effects
from .balance.found import Balance, Term
from .balance.telling import INTERVAL, drawn
from .linear import in_metres

if TYPE_CHECKING:
    from .plant import AxisPlant

LIKELY = 0.5  # confidence from which a law of the balance is named where free runs have not
ALONE = " (shown by the balance along the measured motion, not by free runs)"


def together(
    plant: AxisPlant, found: Sequence[shared.FoundEffect], verdict: str
) -> tuple[list[shared.FoundEffect], list[str]]:
    """Effects as free runs found them, with what the balance says of them, and the names of those it adds."""
    b = plant.balance
    out, added = list(found), []
    for term in b.terms if b is not None else ():
        assert b is not None
        names = [name for name, values in effects(b, term).items() if values]
        if not names:
            continue
        confidence = b.confidence(term)
        own = [k for k, e in enumerate(out) if e.name == names[0] and _is_same(e, effects(b, term)[names[0]])]
        for k in own:
            if out[k].indistinguishable_from:
                continue
            out[k] = replace(out[k], confidence=max(out[k].confidence, round(confidence, 4)))
        told = any(names[0] in (e.name, *e.indistinguishable_from) for e in out)
        if not told and verdict not in ("adequate", "explained") and confidence >= LIKELY:
            out.append(_effect(plant, b, term, names[0]))
            added.append(names[0])
    return out, added


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
    of_set = b.confidence(term) * (1.0 + sum(term.alike.values()) / max(term.wins, 1e-300))
    confidence = round(min(of_set, 1.0) / (1 + len(others)), 4)  # those in a set share what is sure of it
    return shared.FoundEffect(
        name, confidence, others, parameters, said(effect.said(values)) + ALONE, effect.separated_by
    )  # fmt: skip
