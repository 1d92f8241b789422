"""Library effects as candidates, as each declares where a search for it begins; and those that are scanned for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ema.discrepancy.axis.reading.sizes import sizes
from ema.discrepancy.axis.scanning.cogging import cogging_candidate
from ema.discrepancy.axis.scanning.fading import fading_candidate
from ema.discrepancy.axis.scanning.rubbing import rubbing_candidate
from ema.discrepancy.axis.scanning.stretch import stretch_candidate
from ema.discrepancy.plant import Candidate, Free, Point
from ema.effects import registry
from ema.effects.search import AxisSizes

from .gear import gear_candidate
from .play import play_candidate

if TYPE_CHECKING:
    from ema.discrepancy.axis.reading.measured import Measured

PRIOR = 0.5  # standard deviation of a fitted parameter about the plant file's value, relative
SHAPES = ("roundness", "of_inertia")  # of a law, whose ends are those of the effect
BASE_RANGE = 20.0  # a fitted parameter stays within this factor of the plant file's value


def base(plant: Measured) -> tuple[Free, ...]:
    """Friction level, and the parameters the plant file names under `fitted`."""
    p, s = plant.plant, sizes(plant)
    unit = "N" if p.is_linear else "N m"
    free = [Free("F_d", unit, 0.0, 3.0 * s.torque, min(p.F_d, 2.9 * s.torque), 0.05 * s.torque, 1e-3 * s.torque)]
    for name in p.fitted:
        value = float(getattr(p, name))
        field = type(p).model_fields[name].json_schema_extra
        unit = str(field["unit"]) if isinstance(field, dict) else ""
        scale = value if value > 0.0 else 0.1 * s.torque / s.speed
        high = max(value, scale) * BASE_RANGE
        free.append(Free(name, unit, value / BASE_RANGE, high, value, 0.05 * scale, prior=PRIOR * scale))
    for record, zero in plant.zeros.items():
        if zero.angle:
            room = np.pi / max(zero.orders)
            free.append(Free(f"zero:{record}", "rad", zero.angle - room, zero.angle + room, zero.angle, 0.1 * room))
    return tuple(free)


def library(plant: Measured, point: Point, blocks: Sequence[int]) -> list[Candidate]:
    """Every effect of the library that has a meaning for this axis and its channels."""
    s = sizes(plant)
    found = [c for name in registry() if (c := _candidate(plant, s, name, point)) is not None]
    searched = (
        *_clocks_of_the_drive(plant, s, point),
        cogging_candidate(plant, point, blocks),
        gear_candidate(plant, point, blocks),
        play_candidate(plant, point, blocks),
        stretch_candidate(plant, s, point, blocks),
        fading_candidate(plant, s, point, blocks),
        rubbing_candidate(plant, s, point, blocks),
    )
    return [*found, *(c for c in searched if c is not None)]


def _candidate(plant: Measured, s: AxisSizes, name: str, point: Point) -> Candidate | None:
    effect = registry()[name]
    have = any(key.startswith(f"{name}.") for key in point)
    if effect.on_axis is None or have or "axis" not in effect.plants:
        return None
    spec = effect.on_axis(s)
    if spec is None:
        return None
    units = {p.name: p.unit for p in effect.parameters}
    free = tuple(
        Free(f"{name}.{parameter}", units[parameter], low, high, start[0], scale, is_shape=parameter in SHAPES)
        for parameter, (low, high, start, scale) in spec.items()
    )
    grid: list[dict[str, float]] = [{}]
    for parameter, (_, _, starts, _) in spec.items():
        grid = [{**point_, f"{name}.{parameter}": value} for point_ in grid for value in starts]
    return Candidate(name, name, free, tuple(grid))


def _clocks_of_the_drive(plant: Measured, s: AxisSizes, point: Point) -> list[Candidate]:
    """A drive sampled by a clock of its own: what it is late by adds up over the record, or is the same throughout.

    A commanded speed is no reading, and how late it is a matter of its loop.
    """
    moving = [w for w in plant.windows if not w.static]
    if not moving or any(key.startswith("clock_skew.") for key in point):
        return []
    sample = s.period / max(float(np.ptp(w.course[0])) for w in moving)  # of clock error, late by one at the end
    found = [_clock("clock_skew of the drive", "clock_skew.currents", "1", sample, 200.0, (1.0, 5.0))]
    if s.driven_by != "speed-loop":
        found.append(_clock("clock_skew by a constant time", "clock_skew.late", "s", s.period, 20.0, (0.3, 3.0)))
    return found


def _clock(key: str, name: str, unit: str, sample: float, room: float, begin: tuple[float, ...]) -> Candidate:
    """`sample` makes the drive late by one; `room` and where to begin in such, to both sides."""
    free = (Free(name, unit, -room * sample, room * sample, begin[0] * sample, 0.2 * sample),)
    starts = tuple({name: side * x * sample} for side in (-1.0, 1.0) for x in begin)
    return Candidate(key, "clock_skew", free, starts)
