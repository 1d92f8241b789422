"""Which channels of a record are the drive, the outputs, the position."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ema.core.errors import RecordError
from ema.core.names import CHANNELS
from ema.core.records import Record, require
from ema.models.axis_config import Axis, LinearAxis

MIN_SAMPLES = 40
DRIVE_CHANNEL = {"current": "i_q", "voltage": "u_q", "force": "force", "speed-loop": "w_ref"}


@dataclass(frozen=True)
class Roles:
    """Channel names by role; `outputs` are those a simulation is compared with; `kind` is what drives."""

    kind: str
    drive: str
    position: str | None
    speed: str | None
    outputs: tuple[str, ...]
    derived: str | None = None  # a speed that repeats the position


def roles(plant: Axis, record: Record) -> Roles:
    """Roles for this record; RecordError says what is missing."""
    position, speed = ("q", "v") if isinstance(plant, LinearAxis) else ("theta_m", "w_m")
    kind = _kind(plant, record)
    drive = DRIVE_CHANNEL[kind]
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
    _not_clipped(record, (drive, *moving))
    return Roles(kind, drive, position if position in have else None, speed if speed in have else None, tuple(outputs))


def _kind(plant: Axis, record: Record) -> str:
    """What drives in this record: a voltage that stays exactly constant is commanded, whatever the plant file says."""
    complete = None not in (plant.R, plant.k_e, plant.k_t)
    if plant.drive == "current" and complete and "u_q" in record.channels:
        constant = all(np.ptp(cycle["u_q"]) == 0.0 and cycle["u_q"][0] != 0.0 for cycle in record)
        return "voltage" if constant else "current"
    return plant.drive


def _not_clipped(record: Record, names: tuple[str, ...]) -> None:
    """A sensor at its limit shows runs of exactly its largest value."""
    for name in names:
        x = np.concatenate([cycle[name] for cycle in record])
        if len(np.unique(x)) < 5:  # a commanded step or constant is no clipping
            continue
        for limit in (x.max(), x.min()):
            share = float(np.mean(x == limit))
            longest = _longest_run(x == limit)
            if share > 0.03 and longest >= 5:
                raise RecordError(
                    f"{record.name}: {name} is clipped at {limit:g} {CHANNELS[name].unit} "
                    f"({share:.0%} of the samples): a longer range or a smaller motion is needed"
                )


def _longest_run(flags: np.ndarray) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(int), [0]))))
    return int(np.max(edges[1::2] - edges[::2], initial=0))
