"""What fits clearly better and is not named: told with its numbers, and with what stands in its way.

A parameter that ends at the bound of what is searched is fitted again with that bound ten and a hundred times as wide.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ema.discrepancy.axis.judging.witness import N_ITERATIONS, excess
from ema.discrepancy.axis.naming.linear import in_metres
from ema.discrepancy.findings import reject
from ema.discrepancy.fitting import Fit, best_fit
from ema.discrepancy.outcome import Outcome
from ema.discrepancy.plant import Candidate, Free
from ema.discrepancy.trust import at_bound

if TYPE_CHECKING:
    from ema.discrepancy.axis.finding.plant import AxisPlant

CLEAR = 3.0  # deviations of its held-out gain from which an effect is looked at again
LEFT = 0.02  # mean square above that of noise, from which there is something to explain
SHARE = 0.1  # of what is left above noise that it must take
MOST = 3  # effects
WIDER = (10.0, 100.0)  # times the bound


def list_dropped(plant: AxisPlant, outcome: Outcome, named: set[str]) -> list[dict[str, Any]]:
    """What explains a share of the rest and is not in the answer: name, before, after, why."""
    if outcome.verdict == "adequate":
        return []
    blocks = list(range(len(plant.blocks)))
    here = excess(plant.residuals([outcome.point], blocks)[0])
    if here < LEFT:
        return []
    scores = _scores(outcome)
    library = [c for c in plant.candidates(outcome.point, blocks) if c.effect not in named and c.key in scores]
    ranked = sorted(library, key=lambda c: -scores[c.key])[:MOST]
    told = []
    for candidate in ranked:
        fitted = _fit(plant, outcome, candidate, blocks)
        share = 1.0 - excess(fitted.residuals) / max(here, 1e-300)
        at = [f for f in candidate.free if at_bound(f, fitted.point[f.name]) and not f.is_shape]
        wider = [_wider(plant, outcome, candidate, at, factor, here) for factor in WIDER] if at else []
        if max([share, *(s for s, _ in wider)]) > SHARE:
            after = float(np.sqrt(1.0 + excess(fitted.residuals)))
            why = _why(plant, candidate, fitted, share, at, [text for _, text in wider])
            told.append(reject(candidate.key, float(np.sqrt(1.0 + here)), after, why))
    return told


def _scores(outcome: Outcome) -> dict[str, float]:
    """Largest clear gain of each effect in any round, in deviations."""
    out: dict[str, float] = {}
    for entry in outcome.tried:
        sure = entry["score"] / max(entry["error"], 1e-300)
        if sure > CLEAR:
            out[entry["name"]] = max(out.get(entry["name"], 0.0), entry["score"])
    return out


def _fit(plant: AxisPlant, outcome: Outcome, candidate: Candidate, blocks: Sequence[int]) -> Fit:
    starts = [{**outcome.point, **start} for start in candidate.starts]
    return best_fit(plant, [*plant.base, *candidate.free], starts, blocks, max_iterations=N_ITERATIONS)


def _wider(
    plant: AxisPlant, outcome: Outcome, candidate: Candidate, at: Sequence[Free], factor: float, here: float
) -> tuple[float, str]:
    """Share explained, and what is said of it, with the bounds of `at` wider by `factor`."""
    names = {f.name for f in at}
    free = tuple(replace(f, low=f.low * factor, high=f.high * factor) if f.name in names else f for f in candidate.free)
    fitted = _fit(plant, outcome, replace(candidate, free=free), range(len(plant.blocks)))
    share = 1.0 - excess(fitted.residuals) / max(here, 1e-300)
    values = ", ".join(_said(plant, f, fitted) for f in free if f.name in names)
    still = any(at_bound(f, fitted.point[f.name]) for f in free if f.name in names)
    return share, f"{factor:g} times as wide {values}{', its end again' if still else ''}, and it explains {share:.0%}"


def _said(plant: AxisPlant, f: Free, fitted: Fit) -> str:
    unit = in_metres(f.unit) if plant.plant.is_linear else f.unit
    return f"{f.name} = {fitted.point[f.name]:.3g} {unit}"


def _why(
    plant: AxisPlant, candidate: Candidate, fitted: Fit, share: float, at: Sequence[Free], wider: Sequence[str]
) -> str:
    text = f"explains {share:.0%} of what is left"
    if at:
        bounds = "; ".join(
            f"{_said(plant, f, fitted)}, the end of what is searched ({f.low:.3g} … {f.high:.3g})" for f in at
        )
        return f"{text}, with {bounds}; with the bound {'; '.join(wider)}"
    values = ", ".join(_said(plant, f, fitted) for f in candidate.free)
    return f"{text}, with {values}; on held-out parts another cause or none does as well"
