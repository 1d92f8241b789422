"""A torque line of no known cause: locked to the rotor's angle, but at an order that no slots and poles give.

`ema discrepancy` writes it into the plant file when it has found one; it is never a named cause.
"""

from __future__ import annotations

from .base import Effect, Parameter
from .cogging import torque

EFFECT = Effect(
    name="torque_line",
    parameters=(
        Parameter("amplitude", "N m", 0.0, 0.0, 0.1, 0.005, "amplitude of the torque line"),
        Parameter("order", "1/turn", 7.5, 0.1, 240.0, 7.5, "periods per mechanical turn"),
        Parameter("phase", "rad", 0.0, -6.283185307179586, 6.283185307179586, 0.0, "phase at θ_m = 0"),
    ),
    sentence="a torque line of {amplitude:.3g} N m at {order:.4g} periods per rotor turn, of no known cause",
    separated_by="the gears' numbers of teeth, bearings and couplings: what turns at that order",
    laws={"shaft_torque": torque},
    mistaken_for=("k1",),
    plants=("ema",),
)
