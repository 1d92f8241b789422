"""Records as the axis model takes them: what drives, where the file has it in another form.

==================================  ==============================================================================
torque beyond a gear                times or by its ratio, to where position and inertia are
known load on the user's side       over the gear's ratio where position is measured at the motor
duty                                times the supply: the voltage
reference of a position loop        with the drive's gains and the measured motion: what the drive asks for
enabled                             a current or torque that is off is 0, and one that was measured what its sensor
                                    shows of that; of a voltage that is off nothing is known
==================================  ==============================================================================
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ema.core.errors import RecordError
from ema.core.records import Array, Cycle, Record
from ema.models.axis_config import Axis, PositionLoop

from .channels import LOOP_CHANNELS, find_runs
from .smooth import local_polynomial

GIVEN = {"current": "i_q", "voltage": "u_q", "torque": "torque", "force": "force", "duty": "duty"}
SHORTEST = 40  # samples of a part with the drive on
WANDERS = 2.0  # times its noise, by which a reading strays that does not stay where it is
SMOOTH = 3  # samples to each side, over which the speed is taken


def take_in(plant: Axis, records: Sequence[Record]) -> list[Record]:
    """The records with the channel that drives."""
    return [_driven(plant, record) for record in records]


def _driven(plant: Axis, record: Record) -> Record:
    drive = {"current": "i_q", "voltage": "u_q"}.get(plant.drive, plant.drive)
    cycles: list[Cycle] = []
    for cycle in record:
        channels = dict(cycle.channels)
        loop, wanted = plant.position_loop, drive
        if loop is not None and GIVEN[loop.gives] not in channels and drive not in channels:
            channels[GIVEN[loop.gives]] = ask_of_loop(plant, loop, cycle, record.name)
        if wanted == "u_q" and "u_q" not in channels and "duty" in channels:
            channels["u_q"] = channels["duty"] * _supply(plant, channels, record.name)
        if plant.drive == "torque" and "torque" in channels and plant.torque_at != plant.measured_at:
            ratio = plant.gear if plant.measured_at == "load" else 1.0 / plant.gear
            channels["torque"] = channels["torque"] * ratio
        if "load_torque" in channels and plant.measured_at == "motor":
            channels["load_torque"] = channels["load_torque"] / plant.gear
        if "enabled" in channels and wanted in channels:
            cycles += _enabled(plant, replace(cycle, channels=channels), wanted)
        else:
            cycles.append(replace(cycle, channels=channels))
    return replace(record, cycles=tuple(cycles))


def ask_of_loop(plant: Axis, loop: PositionLoop, cycle: Cycle, name: str) -> Array:
    """What a position loop asks for along the measured motion, in its own unit."""
    position, reference = LOOP_CHANNELS[plant.is_linear]
    missing = [channel for channel in (position, reference) if channel not in cycle]
    if missing:
        raise RecordError(f"{name}: position_loop needs the channel {missing[0]} (has {', '.join(cycle.channels)})")
    t = cycle["t"]
    w = local_polynomial(t, cycle[position], SMOOTH, 2)[1]
    w_ref = cycle["w_ref"] if "w_ref" in cycle else np.gradient(cycle[reference], t)
    return of_loop(loop, cycle[reference] - cycle[position], w_ref, w)


def of_loop(loop: PositionLoop, error: Array, w_ref: Array, w: Array) -> Array:
    """y = sat(K_p e + K_d (k_v ω_ref - ω) + F_c sign ω_ref, ±limit)"""
    y = loop.K_p * error + loop.K_d * (loop.k_v * w_ref - w) + loop.F_c * np.sign(w_ref)
    return np.clip(y, -loop.limit, loop.limit)


def _supply(plant: Axis, channels: dict[str, Array], name: str) -> Array | float:
    if "u_dc" in channels:
        return channels["u_dc"]
    if plant.V_dc is None:
        raise RecordError(
            f"{name}: duty is a share of the supply: give the channel u_dc [V], or V_dc in the plant file"
        )
    return plant.V_dc


def _is_measured(drive: Array, on: NDArray[np.bool_]) -> bool:
    """Whether what was recorded of a drive that is off is its sensor's offset and noise, and not what was asked for."""
    off = drive[~on]
    if len(off) < SHORTEST:
        return False
    strays = float(np.median(np.abs(off - np.median(off))))
    noise = float(np.median(np.abs(np.diff(off)))) / np.sqrt(2.0)
    return 0.0 < strays < WANDERS * noise


def _enabled(plant: Axis, cycle: Cycle, drive: str) -> list[Cycle]:
    on = cycle["enabled"] > 0.5
    if drive != "u_q":
        if _is_measured(cycle[drive], on):
            return [cycle]
        return [replace(cycle, channels={**cycle.channels, drive: np.where(on, cycle[drive], 0.0)})]
    parts = [cycle.rows(a, b) for a, b in find_runs(on).tolist() if b - a >= SHORTEST]
    return [replace(part, number=100 * cycle.number + k) for k, part in enumerate(parts)] if len(parts) > 1 else parts
