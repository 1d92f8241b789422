"""A torque of no known cause that depends on the rotor's speed: a table.

`ema discrepancy` writes it into the plant file when it has found one; it is never a named cause.
"""

from __future__ import annotations

from . import table
from .base import Effect


def torque(theta_m, w_m, theta_u, i_q, low, high, t0, t1, t2, t3, t4, t5, t6, t7, t8, t9):
    """τ(ω_m)   [N m]"""
    return table.value(w_m, low, high, t0, t1, t2, t3, t4, t5, t6, t7, t8, t9)


EFFECT = Effect(
    name="speed_torque",
    parameters=table.parameters("rad/s", 2000.0, "rotor speed"),
    sentence="a torque that depends on the rotor's speed, between {low:.3g} and {high:.3g} rad/s, of no known cause",
    separated_by="constant speeds in both directions, at two temperatures",
    laws={"tabulated_torque": torque},
    mistaken_for=("k1",),
    plants=("ema",),
)
