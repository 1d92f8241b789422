"""The one nomenclature table: every channel of a record with its unit and meaning.

Mechanical quantities end in `_m`, electrical in `_e`, of the user (control surface) in `_u`.
"""

from __future__ import annotations

from typing import NamedTuple

FAULTS = ("k1", "k2", "k3", "k4", "k5", "k6")
FAULT_MEANING = {
    "k1": "dry friction",
    "k2": "backlash",
    "k3": "short, phase A",
    "k4": "short, phase B",
    "k5": "short, phase C",
    "k6": "eccentricity",
}
PHASES = ("a", "b", "c")
CURRENTS = ("i_a", "i_b", "i_c")
METHODS = ("linear", "lf2", "lf1", "hf")  # identifiers, each a module of `ema.identification`


class Channel(NamedTuple):
    """Unit and meaning of one channel."""

    unit: str
    meaning: str


CHANNELS = {
    "t": Channel("s", "time since the start of the cycle"),
    "i_a": Channel("A", "phase current A, measured"),
    "i_b": Channel("A", "phase current B, measured"),
    "i_c": Channel("A", "phase current C, measured"),
    "theta_m": Channel("rad", "rotor angle, mechanical"),
    "theta_u": Channel("rad", "user position, by LVDT"),
    "theta_cmd": Channel("rad", "commanded user position"),
    "u_dc": Channel("V", "DC bus voltage"),
    "temp_w": Channel("°C", "winding temperature"),
    "i_q": Channel("A", "q-axis (torque) current"),
    "u_q": Channel("V", "q-axis voltage"),
    "w_m": Channel("rad/s", "rotor speed, mechanical"),
    "w_ref": Channel("rad/s", "commanded rotor speed"),
    "q": Channel("m", "position of a linear axis"),
    "v": Channel("m/s", "speed of a linear axis"),
    "force": Channel("N", "force on a linear axis"),
    "torque": Channel("N m", "torque on a rotary axis"),
    "load_torque": Channel("N m", "torque of a known load on a rotary axis, against positive motion"),
    "load_force": Channel("N", "force of a known load on a linear axis, against positive motion"),
    "theta_ref": Channel("rad", "commanded angle of an axis"),
    "theta_n": Channel("rad", "angle of the neighbouring axis"),
    "q_ref": Channel("m", "commanded position of a linear axis"),
    "duty": Channel("1", "duty cycle of the drive, -1 to 1 of its supply"),
    "enabled": Channel("1", "1 where the drive acts, 0 where it is off"),
}
