"""Supply sag: the DC bus drops with the current drawn through the source resistance."""

from __future__ import annotations

from numba import njit

from .base import Effect, Parameter


@njit(inline="always")
def applied(u, i, resistance, U):
    """Voltage at the motor where `u` is commanded for a supply of `U` that is loaded with (u/U) i.   [V]

    u (U - R_s (u/U) i) / U
    """
    return u * (1.0 - resistance * u * i / (U * U))


@njit(inline="always")
def commanded(u, i, resistance, U):
    """Voltage that has to be commanded for `u` at the motor: the inverse of `applied`.   [V]"""
    return 2.0 * u / (1.0 + max(1.0 - 4.0 * resistance * u * i / (U * U), 0.0) ** 0.5)


EFFECT = Effect(
    name="supply_sag",
    parameters=(Parameter("resistance", "ohm", 0.0, 0.0, 3.0, 0.2, "resistance of source and wiring"),),
    sentence="the supply sags by {resistance:.2g} V per ampere",
    separated_by="record of the bus voltage; a motion fast enough to reach the voltage limit",
    plants=("ema", "axis"),
)
