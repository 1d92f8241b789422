"""Parts of the library of effects: the HF kernel is compiled with those that a run's effects need, and no others.

A kernel with all of them takes more than twice as long for a step as one with none.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import reduce
from operator import or_

from ema.effects import registry

MOTOR, INVERTER, SENSORS, TORQUE, FRICTION, GEAR, TABLES = (1 << bit for bit in range(7))
LOCATED = 1 << 7  # no effect: comparators turn within a step (`ema.models.switching`)

OF_HOOK = {
    "shaft_torque": TORQUE,
    "user_torque": TORQUE,
    "tabulated_torque": TABLES,
    "static_friction": FRICTION,
    "sliding_friction": FRICTION,
    "emf_factor": MOTOR,
    "resistance_factor": MOTOR,
    "inductance_factor": MOTOR,
    "angle_error": SENSORS,
}
OF_STRUCTURAL = {  # effects without laws that the kernel reads itself
    "current_gain": SENSORS,
    "current_offset": SENSORS,
    "commutation_offset": SENSORS,
    "controller_delay": SENSORS,
    "position_delay": SENSORS,
    "speed_delay": SENSORS,
    "supply_sag": INVERTER,
    "dead_time": INVERTER,
    "comparator_delay": INVERTER,
    "gear_compliance": GEAR,
}


def needed(effects: Iterable[str]) -> int:
    """The parts that these effects act in: a sum of the constants above."""
    acts_in = [OF_STRUCTURAL.get(name, 0) for name in effects]
    acts_in += [OF_HOOK[hook] for name in effects for hook in registry()[name].laws]
    return reduce(or_, acts_in, 0)
