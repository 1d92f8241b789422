"""Cogging: the magnets prefer some angles of the slotted stator; lines at multiples of LCM(slots, poles) per turn."""

from __future__ import annotations

from math import pi

from .base import Effect, Parameter
from .vector_math import sin


def torque(theta_m, w_m, theta_u, i_q, amplitude, order, phase):
    """Torque that opposes positive motion.    τ = A sin(n θ_m + φ)   [N m]"""
    return amplitude * sin(order * theta_m + phase)


EFFECT = Effect(
    name="cogging",
    parameters=(
        Parameter("amplitude", "N m", 0.0, 0.0, 0.1, 0.005, "amplitude of the torque line"),
        Parameter("order", "1/turn", 12.0, 1.0, 240.0, 12.0, "periods per mechanical turn"),
        Parameter("phase", "rad", 0.0, -pi, pi, 0.0, "phase at θ_m = 0"),
    ),
    sentence="cogging torque of {amplitude:.3g} N m with {order:.4g} periods per rotor turn",
    separated_by="slow motion over a full rotor turn, or a standstill map of holding current against angle",
    laws={"shaft_torque": torque},
    mistaken_for=("k1",),
    plants=("ema", "axis"),
)
