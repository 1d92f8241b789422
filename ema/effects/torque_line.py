"""A torque line of no known cause: locked to the rotor's angle, but at an order that no slots and poles give.

`ema discrepancy` writes it into the plant file when it has found one; it is never a named cause.
"""

from __future__ import annotations

from dataclasses import replace
from math import pi

from .base import Effect, Parameter
from .cogging import EFFECT as COGGING
from .cogging import torque

_amplitude, _, _phase = COGGING.parameters

EFFECT = Effect(
    name="torque_line",
    parameters=(
        _amplitude,
        Parameter("order", "1/turn", 7.5, 0.1, 240.0, 7.5, "periods per mechanical turn"),
        replace(_phase, low=-2.0 * pi, high=2.0 * pi),
    ),
    sentence="a torque line of {amplitude:.3g} N m at {order:.4g} periods per rotor turn, of no known cause",
    separated_by="the gears' numbers of teeth, bearings and couplings: what turns at that order",
    laws={"shaft_torque": torque},
    mistaken_for=("k1",),
    plants=("ema",),
)
