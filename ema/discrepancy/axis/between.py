"""What the drive of a record does between its samples: a condition of the record, and no flaw of the axis.

A current that is measured runs (nearly) straight from sample to sample. One that a controller or another simulation
commands is held: from the sample on, or, where the recorder writes it after it has acted, up to the sample. Taken for
the other, both position and speed seem half a sample late or early.
"""

from __future__ import annotations

import numpy as np

from ema.discrepancy.examine import examine
from ema.discrepancy.outcome import Outcome
from ema.discrepancy.plant import Point
from ema.discrepancy.selection import Progress, Tried, above_noise, base_model, compare, silent
from ema.discrepancy.verdict import judge

from .plant import AxisPlant

LATE = {"straight": 0.0, "held": 0.5, "held before": -0.5}  # samples by which the motion is later than straight
DELAYS = {"position_delay.time": {"theta_m", "q"}, "speed_delay.time": {"w_m", "v"}}  # and the channels they are of
MUCH = 0.5  # share of what is left above noise, from which another way is taken
NO_MORE = 0.02  # mean square above noise that does not count
NEARLY_HALF = 0.25  # samples by which half a sample may be missed
ALIKE, LITTLE = 1.05, 2e-3  # times what is left, or share in power of what there was: fewer effects are preferred
SAID = {
    "held": "each value is held until the next",
    "held before": "each value has been held since the last",
}


def examined(plant: AxisPlant, progress: Progress = silent) -> Outcome:
    """`examine`, with the drive between samples as the record shows it; told where it does not run straight."""
    if plant.plant.drive == "speed-loop" or all(w.static for w in plant.windows):
        return examine(plant, progress)
    progress("the drive between samples")
    plant.between = _of_plain(plant)
    outcome = examine(plant, progress)
    here, there = plant.between, _beside(plant, outcome)
    if there != here:
        progress(f"again, with a drive that is {there} between samples")
        plant.between = there
        other = examine(plant, progress)
        if _is_simpler(other, outcome):
            outcome = other
        else:
            plant.between = here
    if plant.between in SAID:
        outcome.notes.append(f"between samples the recorded drive does not run straight: {SAID[plant.between]}")
    return outcome


def _of_plain(plant: AxisPlant) -> str:
    """The way that leaves clearly least of what no effect explains, or straight."""
    straight = _plain(plant, "straight")
    n_free = sum(len(f.free) for f in straight.fits)
    if judge(straight.held_out, noise_uncertainty=plant.noise_uncertainty, n_free=n_free).is_noise:
        return "straight"
    tried = {"straight": straight, **{way: _plain(plant, way) for way in SAID}}
    best = min(tried, key=lambda way: tried[way].rms)
    much = above_noise(tried[best]) < MUCH * above_noise(straight)
    return best if much and compare(tried[best], straight).is_clear else "straight"


def _plain(plant: AxisPlant, way: str) -> Tried:
    plant.between = way
    return base_model(plant)


def _beside(plant: AxisPlant, outcome: Outcome) -> str:
    """The way that leaves less though nothing was fitted for it, or held where all sensors are half a sample late."""
    blocks = range(len(plant.blocks))
    period = float(np.median([w.period for w in plant.windows if not w.static]))
    here = plant.between

    def left(way: str) -> float:
        plant.between = way
        point = _less_late(outcome.point, (LATE[way] - LATE[here]) * period)
        residuals = [r.ravel() for r in plant.residuals([point], blocks)[0]]
        return max(float(np.mean(np.clip(np.concatenate(residuals), -8.0, 8.0) ** 2)) - 1.0, 0.0)

    excess = {way: left(way) for way in LATE}
    plant.between = here
    best = min(excess, key=lambda way: excess[way])
    if excess[best] < excess[here] - NO_MORE:
        return best
    seen = {name for b in plant.benches for name in b.roles.outputs}
    late = np.array([outcome.point.get(name, 0.0) for name, of in DELAYS.items() if seen & of]) / period
    by_half = len(late) > 0 and bool((np.abs(late - LATE["held"]) < NEARLY_HALF).all())
    return "held" if here == "straight" and by_half else here


def _less_late(point: Point, by: float) -> Point:
    """The point with what delays it has shorter, as far as they go."""
    return {**point, **{name: max(point[name] - by, 0.0) for name in DELAYS if name in point}}


def _is_simpler(other: Outcome, one: Outcome) -> bool:
    """Whether less is left, or hardly more by fewer effects."""
    rest, other_rest = (max(r.rms_after for r in o.records) for o in (one, other))
    if len(other.effects) >= len(one.effects):
        return len(other.effects) == len(one.effects) and other_rest < rest
    hardly = LITTLE * max(r.rms_before for r in one.records) ** 2
    return other_rest < ALIKE * rest or other_rest**2 < rest**2 + hardly
