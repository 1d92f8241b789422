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
from ema.discrepancy.axis.balance.regressing.found import Balance, Term
from ema.discrepancy.axis.balance.telling.as_effects import effects
from ema.discrepancy.grade import NAMED
from ema.discrepancy.plant import Point
from ema.effects.position_line import EFFECT as POSITION_LINE

from .beside import balance_beside
from .named_laws import find_missing, name_law, name_laws
from .witness import measure_support

if TYPE_CHECKING:
    from ema.discrepancy.axis.finding.plant import AxisPlant


def merge(
    plant: AxisPlant, found: Sequence[shared.FoundEffect], verdict: str, point: Point, *, follows: bool = False
) -> tuple[list[shared.FoundEffect], Balance | None]:
    """Effects as free runs found them at `point`, with what the balance says of them, and a balance that adds some.

    Where free runs follow the motion (`follows`), a law is as sure as they need it too.
    """
    b = plant.balance
    out = list(found)
    for term in b.terms if b is not None else ():
        assert b is not None
        name = name_law(b, term)
        own = [k for k, e in enumerate(out) if e.name == name and _is_same(e, effects(b, term)[name], b.travel)]
        for k in own:
            out[k] = _with_pairs(out[k], b, term)
            if out[k].indistinguishable_from or verdict == "partly explained":
                continue  # what it leaves unexplained it may have been taken for, however often it wins
            out[k] = replace(out[k], confidence=max(out[k].confidence, round(b.confidence(term), 4)))
    if b is None or verdict in ("adequate", "explained") or not find_missing(b, out):
        return out, None
    if found:
        b = balance_beside(plant, point)
    added = find_missing(b, out) if b is not None else []
    if b is not None and follows:
        added = [_limit(t, share) for t, share in zip(added, measure_support(plant, point, b, added), strict=True)]
        added = [t for t in added if b.of_set(t) >= NAMED]
    if b is None or not added:
        return out, None
    return [*out, *name_laws(plant, b, added)], b


def _with_pairs(e: shared.FoundEffect, b: Balance, term: Term) -> shared.FoundEffect:
    """With what does as well in the balance beside one law more: free runs try one in the place of another, not two."""
    pairs = {r.laws[-1].name for r in term.instead if len(r.laws) > len(b.model.laws)}
    others = tuple(sorted({*e.indistinguishable_from, *pairs}))
    if len(others) == len(e.indistinguishable_from):
        return e
    return replace(e, confidence=round(e.of_set / (1 + len(others)), 4), indistinguishable_from=others, of_others=None)


def _limit(term: Term, share: float) -> Term:
    """A law and what does as well, each as sure as `share` allows."""
    return replace(term, wins=share * term.wins, alike={name: share * wins for name, wins in term.alike.items()})


def _is_same(e: shared.FoundEffect, values: dict[str, float], travel: float) -> bool:
    """Of a line, the same: orders of a turn are whole, along a travel those that a period of it tells apart are two."""
    order = e.parameters.get("order")
    if order is None:
        return True
    apart = 2.0 * np.pi / travel if e.name == POSITION_LINE.name else 0.5
    return abs(order.value - values.get("order", order.value)) < apart
