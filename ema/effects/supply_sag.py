"""Supply sag: the DC bus drops with the current drawn through the source resistance."""

from __future__ import annotations

from collections.abc import Mapping

from numba import njit

from .base import NOT_NEGATIVE, Effect, Parameter
from .search import AxisSizes, Look, Span


@njit(inline="always")
def link_voltage(u_dc, V_dc, i_dc, resistance, capacitance, dt):
    """Voltage of the DC link one implicit step on; without a capacitor it follows the current at once.   [V]

    C du/dt = (V - u) / R_s - i
    """
    return u_dc + dt / (resistance * capacitance + dt) * (V_dc - resistance * i_dc - u_dc)


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


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins, by what the records hold."""
    if s.supply is None or not s.shows_voltage:
        return None
    R = s.supply**2 / (s.voltage * s.current)  # at which nothing would be left of the supply
    return {"resistance": Span(0.0, 0.2 * R, (0.01 * R,), 0.01 * R)}


EFFECT = Effect(
    name="supply_sag",
    parameters=(
        Parameter("resistance", "ohm", 0.0, 0.0, 3.0, 0.2, "resistance of source and wiring"),
        Parameter("capacitance", "F", 0.0, 0.0, 0.02, 5e-3, "capacitor of the DC link (three-phase actuator)"),
    ),
    sentence="the supply sags by {resistance:.2g} V per ampere",
    besides={"capacitance": ", behind a capacitor of {capacitance:.2g} F"},
    separated_by="record of the bus voltage; a motion fast enough to reach the voltage limit",
    plants=("ema", "axis"),
    limits={"resistance": NOT_NEGATIVE, "capacitance": NOT_NEGATIVE},
    looks=(Look("resistance", at={"capacitance": 5e-3}, needs="supply"),),
    on_axis=on_axis,
)
