"""Which channels of a record are the drive, the outputs, the position."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import correlate, savgol_filter

from ema.core.errors import RecordError
from ema.core.names import CHANNELS
from ema.core.records import Array, Cycle, Record, require
from ema.models.axis_config import Axis

MIN_SAMPLES = 40
MAX_LAG = 30  # samples; less is a delay that can be examined
ENTERING = 3  # samples before a limit, over which a position shows that it slows down
NOT_SLOWED = 0.4  # of its usual speed
ONE_SCALE = 1.25  # ratio of the recorded speed to that of the position
IN_STEP = 0.8  # correlation of the torque that the motion needs with the recorded one
LOAD_CHANNEL = {False: "load_torque", True: "load_force"}  # of an axis that is linear, or not
LOOP_CHANNELS = {False: ("theta_m", "theta_ref"), True: ("q", "q_ref")}  # position and reference, by the same
DRIVE_CHANNEL = {"current": "i_q", "voltage": "u_q", "force": "force", "torque": "torque", "speed-loop": "w_ref"}


@dataclass(frozen=True)
class Roles:
    """Channel names by role; `outputs` are those a simulation is compared with; `kind` is what drives.

    `load` is that of a known load.
    """

    kind: str
    drive: str
    position: str | None
    speed: str | None
    outputs: tuple[str, ...]
    derived: str | None = None  # a speed that repeats the position
    load: str | None = None


def roles(plant: Axis, record: Record) -> Roles:
    """Roles for this record; RecordError says what is missing."""
    position, speed = ("q", "v") if plant.is_linear else ("theta_m", "w_m")
    kind = _kind(plant, record)
    drive = DRIVE_CHANNEL[plant.drive if plant.is_force else kind]
    require(record, ("t", drive), min_samples=2)
    have = record.channels
    if position not in have and speed not in have:
        raise RecordError(
            f"{record.name}: missing channel {position} [{CHANNELS[position].unit}] or "
            f"{speed} [{CHANNELS[speed].unit}] (has {', '.join(have)})"
        )
    outputs = [name for name in (position, speed) if name in have]
    if kind == "current" and "u_q" in have and plant.R is not None and plant.k_e is not None:
        outputs.append("u_q")
    if kind in ("voltage", "speed-loop") and "i_q" in have:
        outputs.append("i_q")
    moving = [name for name in (position, speed) if name in have]
    if all(np.ptp(cycle[name]) == 0.0 for name in moving for cycle in record):
        raise RecordError(
            f"{record.name}: the axis does not move ({' and '.join(moving)} constant): nothing to compare"
        )
    load = _load(plant, record)
    _finite(record, (drive, *outputs, *([load] if load else [])))
    commanded = kind in ("voltage", "speed-loop") or plant.position_loop is not None  # a drive may go to its limit
    _not_clipped(record, tuple(moving) if commanded else (drive, *moving), position)
    if speed in have and position in have:
        _one_scale(record, position, speed)
    if speed in have and kind in ("current", "force"):
        _in_step(plant, record, drive, speed, load)
    moves = (position if position in have else None, speed if speed in have else None)
    return Roles(kind, drive, *moves, tuple(outputs), load=load)


def _kind(plant: Axis, record: Record) -> str:
    """What drives in this record: a voltage that stays exactly constant is commanded, whatever the plant file says."""
    complete = None not in (plant.R, plant.k_e, plant.k_t)
    if plant.drive == "current" and complete and "u_q" in record.channels:
        constant = all(np.ptp(cycle["u_q"]) == 0.0 and cycle["u_q"][0] != 0.0 for cycle in record)
        return "voltage" if constant else "current"
    return "force" if plant.is_force else plant.drive


def _finite(record: Record, names: tuple[str, ...]) -> None:
    for cycle in record:
        for name in names:
            bad = np.flatnonzero(~np.isfinite(cycle[name]))
            if bad.size:
                raise RecordError(
                    f"{record.name}: {cycle}: {name} is not a number at t = {cycle['t'][bad[0]]:g} s "
                    f"({bad.size} samples): cut these out or split the cycle there"
                )


def _one_scale(record: Record, position: str, speed: str) -> None:
    """Where it moves, the position must change as fast as the speed says: other units and signs are no effect."""
    ratios = []
    for cycle in record:
        width = min(11, cycle.n_samples // 2 * 2 - 1)
        if width < 3:
            continue
        x, w = (savgol_filter(cycle[name], width, 1) for name in (position, speed))
        moves = np.gradient(x, cycle["t"])
        fast = np.abs(w) > max(0.5 * float(np.sqrt(np.mean(w**2))), 1e-300)
        ratios.append(moves[fast] / w[fast])
    ratio = float(np.median(np.concatenate(ratios))) if ratios and any(r.size for r in ratios) else 1.0
    if not 1.0 / ONE_SCALE < ratio < ONE_SCALE:
        raise RecordError(
            f"{record.name}: {position} changes {ratio:.3g} times as fast as {speed} [{CHANNELS[speed].unit}] says: "
            "one of them has another unit or sign than its header"
        )


def _in_step(plant: Axis, record: Record, drive: str, speed: str, load: str | None) -> None:
    """The torque that the motion needs must lie over the one that was recorded, not seconds beside it."""
    best: dict[int, list[float]] = {}
    for cycle in record:
        t, w = cycle["t"], cycle[speed]
        if cycle.n_samples < 4 * MAX_LAG:
            continue
        width = min(21, cycle.n_samples // 8 * 2 + 1)
        smooth = savgol_filter(w, width, 2)
        need = plant.inertia * np.gradient(smooth, t) + plant.C * smooth + plant.F_d * np.sign(smooth)
        given = savgol_filter(cycle[drive], width, 2) * (1.0 if plant.is_force else float(plant.k_t or 1.0))
        given -= known_load(cycle, load)
        need, given = need - need.mean(), given - given.mean()
        lag = int(np.argmax(correlate(need, given, mode="same"))) - len(need) // 2
        here, there = _alike(need, given, 0), _alike(need, given, lag)
        best.setdefault(lag, []).append(there)
        if abs(lag) <= MAX_LAG or there < IN_STEP or here > 0.5 * IN_STEP:
            return
    if best:
        lag = max(best, key=lambda k: len(best[k]))
        shift = lag * record.cycles[0].period
        raise RecordError(
            f"{record.name}: {speed} runs {abs(shift):.3g} s {'behind' if shift > 0.0 else 'ahead of'} {drive}: the "
            "channels are out of step; record them on one clock"
        )


def _load(plant: Axis, record: Record) -> str | None:
    """Channel of the known load, None without one; RecordError for one that such an axis cannot have."""
    own, other = LOAD_CHANNEL[plant.is_linear], LOAD_CHANNEL[not plant.is_linear]
    if own in record.channels:
        return own
    if other in record.channels:
        kind = "linear" if plant.is_linear else "rotary"
        raise RecordError(
            f"{record.name}: {other} [{CHANNELS[other].unit}] is no load of a {kind} axis, which takes {own} "
            f"[{CHANNELS[own].unit}]: map it to that, scaled by its lever, or to `ignore`"
        )
    return None


def known_load(cycle: Cycle, channel: str | None) -> Array:
    """Torque or force of a known load at a cycle's samples, 0 where none was recorded. [N m or N]"""
    return cycle[channel] if channel is not None and channel in cycle else np.zeros(cycle.n_samples)


def _alike(x: Array, y: Array, lag: int) -> float:
    """Correlation of x with y shifted by `lag` samples, where they overlap."""
    a, b = (x[lag:], y[: len(y) - lag]) if lag >= 0 else (x[:lag], y[-lag:])
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 0.0 else 0.0


def _not_clipped(record: Record, names: tuple[str, ...], position: str) -> None:
    """A sensor at its limit shows runs of exactly its largest value; a position does where the axis rests there too."""
    for name in names:
        x = np.concatenate([cycle[name] for cycle in record])
        if len(np.unique(x)) < 5:  # a commanded step or constant is no clipping
            continue
        for limit in (limit for limit in (x.max(), x.min()) if limit != 0.0):  # at zero it rests
            share = float(np.mean(x == limit))
            longest = int(np.diff(find_runs(x == limit)).max())
            if share > 0.03 and longest >= 5 and (name != position or is_cut_off(x, limit)):
                raise RecordError(
                    f"{record.name}: {name} is clipped at {limit:g} {CHANNELS[name].unit} "
                    f"({share:.0%} of the samples): a longer range or a smaller motion is needed"
                )


def is_cut_off(x: Array, limit: float) -> bool:
    """Whether a position arrives at its limit without having slowed down, as no axis does that comes to rest there."""
    moves = np.abs(x[ENTERING:] - x[:-ENTERING])
    at = x == limit
    arrivals = np.flatnonzero(at[1:] & ~at[:-1]) + 1 - ENTERING
    arrivals = arrivals[arrivals >= 0]
    finest = np.abs(np.diff(np.unique(x))).min()
    typical = max(NOT_SLOWED * float(np.sqrt(np.mean(moves**2))), ENTERING * finest)
    return bool(arrivals.size) and float(np.median(moves[arrivals])) > typical


def find_runs(flags: NDArray[np.bool_]) -> NDArray[np.int_]:
    """First and one past the last sample of each run of what is true, shape (n_runs, 2)."""
    return np.flatnonzero(np.diff(flags.astype(int), prepend=0, append=0)).reshape(-1, 2)
