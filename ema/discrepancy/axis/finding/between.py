"""What the drive of a record does between its samples: a condition of the record, and no flaw of the axis.

A current that is measured runs (nearly) straight from sample to sample. One that a controller or another simulation
commands is held: from the sample on, or, where the recorder writes it after it has acted, up to the sample. Taken for
the other, both position and speed seem half a sample late or early.

A speed loop may act once for each sample of the record, or faster. Taken for the other, its axis seems heavier or
lighter by half a sample in the loop's time constant; where the record does not show which, only what both say is known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ema.discrepancy.examine import examine
from ema.discrepancy.fitting import Fit, fit
from ema.discrepancy.grade import UNSOLVED
from ema.discrepancy.outcome import Outcome
from ema.discrepancy.plant import Free, Point
from ema.discrepancy.progress import Progress
from ema.discrepancy.rounds import judge_model
from ema.discrepancy.selection import ODDS, Tried, above_noise, compare, fit_base, refit, try_at

from .plant import AxisPlant

LATE = {"straight": 0.0, "held": 0.5, "held before": -0.5}  # samples by which the motion is later than straight
# The same of a speed loop that acts once a sample, or all the time, on a command that is held or runs straight.
LATE_IN_LOOP = {"straight": 0.5, "fast": 0.0, "analogue": 0.0}
DELAYS = {"position_delay.time": {"theta_m", "q"}, "speed_delay.time": {"w_m", "v"}}  # and the channels they are of
OF_DRIVE = {"drive_lag.time": 0.0, "clock_skew.late": -np.inf}  # what else makes the motion late, and the least of it
LEAST = {**dict.fromkeys(DELAYS, 0.0), **OF_DRIVE}
HALF, CANNOT_TELL = 0.5, 0.5  # samples by which a drive may be ahead or behind a straight line; the odds are even
MUCH = 0.5  # share of what is left above noise, from which another way is taken
NEARLY_HALF = 0.25  # samples by which half a sample may be missed
ALIKE, LITTLE = 1.05, 2e-3  # times what is left, or share in power of what there was: fewer effects are preferred
SAID = {
    "held": "between samples the recorded drive does not run straight: each value is held until the next",
    "held before": "between samples the recorded drive does not run straight: each value has been held since the last",
    "fast": "the speed loop acts between the samples of the record too",
    "analogue": "the speed loop and its command act between the samples of the record too",
}


def examine_ways(plant: AxisPlant, progress: Progress | None = None) -> Outcome:
    """`examine`, with the drive between samples as the record shows it; told where it does not run straight."""
    progress = progress or Progress()
    if all(w.static for w in plant.windows):
        return examine(plant, progress)
    progress("the balance along the measured motion")
    is_linked = plant.is_linked
    progress("the drive between samples")
    if is_linked:
        plant.between = _of_balance(plant)
        return _say_way(plant, examine(plant, progress))
    plant.between = _of_plain(plant)
    reread = Rereading(plant, progress)
    outcome = examine(plant, progress, reread, plant.seen_together)
    here = plant.between
    there = _beside(plant, outcome)
    if there == here:
        there = _find_doubt(plant, outcome)
    if there != here:
        progress(f"again, with a drive that is {there} between samples")
        plant.between = there
        other = examine(plant, progress, reread.but(here), plant.seen_together)
        there = plant.between
        alike = plant.plant.drive == "speed-loop" and _alike(other, outcome)
        if _is_simpler(other, outcome):
            outcome, other = other, outcome
            plant.between = there
        else:
            plant.between = here
        if alike:
            _widen(outcome, other)
            outcome.notes.append(
                "the record does not show whether the speed loop acts between its samples too: intervals hold both"
            )
            return outcome
    _widen_delay(plant, outcome)
    _doubt_small_delay(plant, outcome)
    return _say_way(plant, outcome)


def _say_way(plant: AxisPlant, outcome: Outcome) -> Outcome:
    """The outcome, with a note where the drive does not run straight."""
    if plant.between in SAID:
        outcome.notes.append(SAID[plant.between])
    return outcome


class Rereading:
    """Takes the drive another way where this alone foretells more than the best further effect (`rounds.Reread`).

    What a drive does between samples has no parameter to fit: the one with the larger gain on held-out parts is it. A
    speed loop is left as it is (`_doubted`): acting faster is as good as any inertia.
    """

    def __init__(self, plant: AxisPlant, progress: Progress, ways: Sequence[str] = tuple(LATE)) -> None:
        self._plant, self._progress, self._ways, self._turns = plant, progress, ways, len(LATE)

    def but(self, way: str) -> Rereading:
        """The same without a way with which all was examined already."""
        return Rereading(self._plant, self._progress, [w for w in self._ways if w != way])

    def __call__(self, model: Tried, further: Tried) -> bool:
        """Whether the plant's records are taken another way from now on, for `model` and instead of `further`."""
        plant, here = self._plant, self._plant.between
        if plant.plant.drive == "speed-loop" or self._turns == 0:
            return False
        tried = {}
        for way in [way for way in self._ways if way != here]:
            plant.between = way
            self._progress(f"a drive that is {way} between samples")
            tried[way] = refit(plant, model)
        plant.between = here
        if not tried:
            return False
        best = max(tried, key=lambda way: compare(tried[way], model).gain)
        if compare(tried[best], model).gain < ODDS or not _is_no_worse(tried[best], further):
            return False
        self._turns -= 1
        plant.between = best
        return True


def _is_no_worse(taken: Tried, further: Tried) -> bool:
    """Whether records taken another way foretell as much as with a further effect.

    A drive that is held is half a sample late, and what delays it or a sensor has a parameter to fit besides: that must
    be clearly better.
    """
    gain = compare(further, taken)
    is_late = any(f.name in OF_DRIVE or f.name in DELAYS for f in further.accepted[-1].free)
    return not gain.is_clear if is_late else gain.gain <= 0.0


def _find_doubt(plant: AxisPlant, outcome: Outcome) -> str:
    """Another way that what was found, or not, may come from."""
    if plant.plant.drive == "speed-loop" and outcome.effects:
        return _likeliest_other(plant, outcome.model)
    if plant.between != "straight" and outcome.verdict in UNSOLVED:
        return "straight"  # what looked like a drive that is held may have been something that is missing
    return plant.between


def _likeliest_other(plant: AxisPlant, model: Tried) -> str:
    """Of the other ways, the one with which the same effects foretell most."""
    here, tried = plant.between, {}
    for way in [way for way in _ways(plant) if way != here]:
        plant.between = way
        tried[way] = refit(plant, model)
    plant.between = here
    return max(tried, key=lambda way: compare(tried[way], model).gain)


def _alike(one: Outcome, other: Outcome) -> bool:
    """Whether two outcomes name the same effects and leave nearly the same."""
    rests = sorted(max(r.rms_after for r in o.records) for o in (one, other))
    names = [sorted((e["name"], *e["parameters"]) for e in o.effects) for o in (one, other)]
    return names[0] == names[1] and rests[1] < ALIKE * rests[0]


def _widen(outcome: Outcome, other: Outcome) -> None:
    """Let the intervals of an outcome hold those of another one with the same effects."""
    for effect, same in zip(_sorted(outcome.effects), _sorted(other.effects), strict=True):
        for own, there in zip(effect["parameters"].values(), same["parameters"].values(), strict=True):
            own["low"], own["high"] = min(own["low"], there["low"]), max(own["high"], there["high"])


def _sorted(effects: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """By name; of cogging there may be several lines."""
    return sorted(effects, key=lambda e: (e["name"], e["parameters"].get("order", {"value": 0.0})["value"]))


def _of_plain(plant: AxisPlant) -> str:
    """The way that leaves clearly least of what no effect explains, or straight."""
    straight = _plain(plant, "straight")
    if judge_model(plant, straight).is_noise:
        return "straight"
    tried = {way: straight if way == "straight" else _plain(plant, way) for way in _ways(plant)}
    best = min(tried, key=lambda way: tried[way].rms)
    much = above_noise(tried[best]) < MUCH * above_noise(straight)
    return best if much and compare(tried[best], straight).is_clear else "straight"


def _of_balance(plant: AxisPlant) -> str:
    """The way by which the balance leaves clearly least of held-out blocks, or straight: free runs know too little."""

    def left(way: str) -> Tried:
        plant.between = way
        assert plant.balance is not None
        of, rows = plant.balance.model, plant.balance.model.rows
        scaled = (of.held_out / rows.sigma)[np.newaxis]
        return Tried((), (), (), tuple(scaled[:, rows.whole & (rows.block == k)] for k in range(rows.n_blocks)))

    ways = {way: left(way) for way in LATE}
    best = min(ways, key=lambda way: ways[way].rms)
    return best if compare(ways[best], ways["straight"]).is_significant else "straight"


def _ways(plant: AxisPlant) -> Mapping[str, float]:
    """How the drive may be taken, and by how many samples the motion is late in each."""
    return LATE_IN_LOOP if plant.plant.drive == "speed-loop" else LATE


def _plain(plant: AxisPlant, way: str) -> Tried:
    plant.between = way
    return fit_base(plant)


def _beside(plant: AxisPlant, outcome: Outcome) -> str:
    """The likelier way, though nothing was fitted for it, or that by which sensors or the drive are half a sample late.

    It counts where nothing but noise is left too: taken for straight, a held drive is half a sample early, in a swing
    that is less drag than there is, and less drag is what tells a heavier axis from a drive that reads too much.
    """
    if plant.plant.drive == "speed-loop":
        return plant.between
    here, period = plant.between, _period(plant)

    def taken(way: str) -> Tried:
        plant.between = way
        less = (LATE[way] - LATE[here]) * period
        found = [try_at(plant, _shorten_delays(outcome.point, less))]
        if way != here and OF_DRIVE.keys() & outcome.point.keys():
            late = _with_constant_delay(plant, outcome.point, less)
            found.append(try_at(plant, late.point, late.residuals))
        return max(found, key=lambda own: compare(own, found[0]).gain)

    ways = {way: taken(way) for way in LATE}
    plant.between = here
    best = max(ways, key=lambda way: compare(ways[way], ways[here]).gain)
    if compare(ways[best], ways[here]).gain > ODDS:
        return best
    seen = {name for b in plant.benches for name in b.roles.outputs}
    late = np.array([outcome.point.get(name, 0.0) for name, of in DELAYS.items() if seen & of]) / period
    by_half = len(late) > 0 and bool((np.abs(late - LATE["held"]) < NEARLY_HALF).all())
    later = sum(outcome.point.get(name, 0.0) for name in OF_DRIVE) / period
    by_drive = [way for way in LATE if way != "straight" and abs(later - LATE[way]) < NEARLY_HALF]
    return ("held" if by_half else next(iter(by_drive), here)) if here == "straight" else here


def _with_constant_delay(plant: AxisPlant, point: Point, less: float) -> Fit:
    """The fit at a point whose drive is late by a constant time in the place of what delays it, `less` than that.

    Of either sign: what lags by one way to take the drive may be early by another.
    """
    late = sum(point.get(own, 0.0) for own in OF_DRIVE) - less
    others = {own: value for own, value in point.items() if own not in OF_DRIVE}
    return _fit_delay(plant, "clock_skew.late", {**others, "clock_skew.late": late})


def _fit_delay(plant: AxisPlant, name: str, point: Point) -> Fit:
    """The fit of what delays a sensor or the drive, beside the base parameters."""
    delay = Free(name, "s", LEAST[name], np.inf, point[name], 0.1 * _period(plant))
    return fit(plant, [*plant.base, delay], point, range(len(plant.blocks)))


def _period(plant: AxisPlant) -> float:
    return float(np.median([w.period for w in plant.windows if not w.static]))


def _widen_delay(plant: AxisPlant, outcome: Outcome) -> None:
    """Let the interval of what delays a sensor or the drive hold what it is with each way that is not ruled out."""
    for name in LEAST.keys() & outcome.point.keys():
        effect, parameter = name.split(".")
        told = [e["parameters"][parameter] for e in outcome.effects if e["name"] == effect]
        _widen_by_ways(plant, outcome, name, told)


def _doubt_small_delay(plant: AxisPlant, outcome: Outcome) -> None:
    """Halve what is sure of a delay within half a sample, where nothing but the drive and one sensor tells of it.

    A current that settles before its next sample is ahead of a straight line by as much, and no way to take it knows
    that.
    """
    if plant.plant.drive == "speed-loop":
        return
    seen = {name for b in plant.benches for name in b.roles.outputs} & set().union(*DELAYS.values())
    names = [name for name, of in LEAST.items() if name in outcome.point and (name in OF_DRIVE or seen <= DELAYS[name])]
    late = LATE[plant.between] + sum(outcome.point[name] for name in names) / _period(plant)
    of = [e for e in outcome.effects if any(name.split(".")[0] == e["name"] for name in names)]
    if abs(late) < HALF and of:
        for e in of:
            e["confidence"] *= CANNOT_TELL
        side = "late" if late > 0.0 else "early"
        outcome.notes.append(
            f"the motion is {abs(late):.2g} samples {side}: that may also be what the drive does between samples"
        )


def _widen_by_ways(plant: AxisPlant, outcome: Outcome, name: str, told: list[dict[str, float]]) -> None:
    here, period, fits, tried = plant.between, _period(plant), {}, {}
    for way, late in (ways := _ways(plant)).items():
        plant.between = way
        point = _shorten_delays(outcome.point, (late - ways[here]) * period)
        fits[way] = _fit_delay(plant, name, point)
        tried[way] = try_at(plant, fits[way].point, fits[way].residuals)
    plant.between = here
    for way, f in fits.items():
        if not compare(tried[here], tried[way]).is_clear:
            for interval in told:
                later = f.point[name] - fits[here].point[name]
                interval["low"] = max(interval["low"] + min(later, 0.0), LEAST[name])
                interval["high"] += max(later, 0.0)


def _shorten_delays(point: Point, by: float) -> Point:
    """The point with what delays it has shorter, as far as they go."""
    return {**point, **{name: max(point[name] - by, low) for name, low in LEAST.items() if name in point}}


def _is_simpler(other: Outcome, one: Outcome) -> bool:
    """Whether held-out parts are likelier, hardly less is left by fewer effects, or far less and clearly by more."""
    rest, other_rest = (max(r.rms_after for r in o.records) for o in (one, other))
    gain = compare(other.model, one.model)
    if len(other.effects) > len(one.effects):
        return gain.is_clear and max(other_rest**2 - 1.0, 0.0) < MUCH * max(rest**2 - 1.0, 0.0)
    if len(other.effects) == len(one.effects):
        return gain.gain > 0.0
    hardly = LITTLE * max(r.rms_before for r in one.records) ** 2
    return other_rest < ALIKE * rest or other_rest**2 < rest**2 + hardly
