"""Play of a gear: impacts make a valley too narrow and too rough for a fit to find, so a population looks for it.

It does so only where the balance of torque leaves more than noise: whatever else is missing there is mostly its laws'.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import OptimizeResult, differential_evolution

from ema.core.records import Array
from ema.discrepancy.fitting import rate, scale_of
from ema.discrepancy.plant import Candidate, Free, Point
from ema.effects.gear_play import EFFECT
from ema.models.axis_config import BEYOND_GEAR

if TYPE_CHECKING:
    from ema.discrepancy.axis.reading.measured import Measured

NAME = EFFECT.name
# Gap over the travel in a window, and samples that teeth stay together, by their logarithms; of the inertia, behind the
# gap; damping ratio where teeth meet; of dry friction, behind the gap; inertia, dry friction and drag over what they
# are without play, which took some of its part.
RANGES = (
    *((np.log(1e-3), np.log(0.5)), (np.log(1.0), np.log(20.0)), (0.05, 0.95), (0.02, 0.9)),
    *((0.0, 1.0), (0.8, 1.25), (0.3, 1.5), (0.0, 1.5)),
)
POPULATION, GENERATIONS = 8, 100  # members per parameter, and how often they are renewed
AGAIN = 15  # generations where play was found before, beside other effects
IN_DOUBT = 20  # generations after which a population that has found nothing better than no play is left
LOOKED_AT = 4_000  # samples
LEFT = 2.0  # times what noise makes, by which a balance is off where play is worth a search
SEED = 1
ROUGH = 0.045  # share of a parameter by which populations end off, of five records (rms): impacts make many minima


def play_candidate(plant: Measured, point: Point, blocks: Sequence[int]) -> Candidate | None:
    """The likeliest play as a start, or None where none fits better than no play."""
    taken = any(key.startswith(BEYOND_GEAR) for key in point)
    moving = [j for j in blocks if not plant.windows[j].static]
    if taken or not moving or plant.plant.drive == "speed-loop":
        return None
    if plant.left_by_balance < LEFT * LEFT:  # a load that comes and goes is none of its laws
        return None
    beside = frozenset(key.partition(".")[0] for key in point)
    if any(x is None for (*_, of), x in plant.plays.items() if of == beside):
        return None  # no other part of the records, nor way to take the drive, makes impacts
    key = (tuple(blocks), plant.between, beside)
    looked_at = _some(plant, moving)
    start = _started(plant, point, looked_at)
    if key not in plant.plays:
        before = next((x for x in plant.plays.values() if x is not None), None)
        plant.plays[key] = _search(plant, point, start, looked_at, before)
    x = plant.plays[key]
    if x is None:
        return None
    best = start(x)
    F = best.get("F_d", plant.plant.F_d) + best[f"{NAME}.friction"]
    bounds = {
        "gap": 10.0 * best[f"{NAME}.gap"],
        "inertia": 0.97 * best.get("J", plant.plant.inertia),
        "damping": 1.0,
        "compliance": 10.0 * best[f"{NAME}.compliance"],
        **({"friction": 2.0 * F} if best[f"{NAME}.friction"] > 0.0 else {}),
    }
    return Candidate(NAME, NAME, tuple(_free(name, best, high) for name, high in bounds.items()), (best,))


def _started(plant: Measured, point: Point, windows: Sequence[int]) -> Callable[[Array], Point]:
    """What members of a population (see `RANGES`) mean."""
    own = plant.plant
    travel = max(float(np.ptp(plant.windows[j].position)) for j in windows)
    period = max(plant.windows[j].period for j in windows)
    J, F, C = (max(point.get(name, x), x) for name, x in (("J", own.inertia), ("F_d", own.F_d), ("C", own.C)))
    fitted = {f.name for f in plant.base}
    driven = {f"{NAME}.driven": 1.0} if own.measured_at == "load" else {}

    def start(x: Array) -> Point:
        size, together, behind, damped, rubs, heavier, rougher, drags = x.tolist()
        inertia, friction = heavier * J if "J" in fitted else J, rougher * F
        values = {
            "gap": travel * float(np.exp(size)),
            "compliance": float(np.exp(together) * period / np.pi) ** 2 / (behind * (1.0 - behind) * inertia),
            "inertia": behind * inertia,
            "damping": damped,
            "friction": rubs * friction,
        }
        base = {"J": inertia, "F_d": (1.0 - rubs) * friction, "C": drags * C}
        more = {name: value for name, value in base.items() if name in fitted}
        return {**more, **driven, **{f"{NAME}.{name}": value for name, value in values.items()}}

    return start


def _search(
    plant: Measured, point: Point, start: Callable[[Array], Point], windows: Sequence[int], before: Array | None
) -> Array | None:
    """The best member of a population, or None where it is no better than no play; `before`: one found elsewhere."""
    without = plant.residuals([point], windows)[0]
    scale = scale_of(without)

    def lost(members: Array) -> Array:
        runs = plant.residuals([{**point, **start(x)} for x in members.T], windows)
        here, *there = rate([without, *runs], scale=scale)
        return here - np.array(there)

    generations = iter(range(GENERATIONS))

    def is_in_vain(intermediate_result: OptimizeResult) -> bool:
        return next(generations) >= IN_DOUBT and intermediate_result.fun >= 0.0

    found = differential_evolution(
        lost,
        RANGES,
        x0=before,
        popsize=POPULATION,
        maxiter=GENERATIONS if before is None else AGAIN,
        rng=SEED,
        vectorized=True,
        updating="deferred",
        polish=False,
        callback=is_in_vain,
    )
    return np.asarray(found.x) if found.fun < 0.0 else None


def _free(name: str, best: Point, high: float) -> Free:
    start = best[f"{NAME}.{name}"]
    unit = next(p.unit for p in EFFECT.parameters if p.name == name)
    rough = ROUGH * (start or high)
    return Free(f"{NAME}.{name}", unit, 0.0, high, start, 0.05 * (start or high), rough, rough=rough)


def _some(plant: Measured, windows: Sequence[int]) -> list[int]:
    """The first windows, as many as hold `LOOKED_AT` samples: where a load lies in its gap is simulated from before."""
    ends = np.cumsum([plant.windows[j].n for j in windows])
    return list(windows[: 1 + int(np.searchsorted(ends, LOOKED_AT))])
