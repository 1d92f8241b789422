"""A torque of no known cause that depends on where the user is: a table.

`ema discrepancy` writes it into the plant file when it has found one; it is never a named cause.
"""

from __future__ import annotations

from . import table
from .base import Effect


def torque(theta_m, w_m, theta_u, i_q, low, high, t0, t1, t2, t3, t4, t5, t6, t7, t8, t9):
    """τ(θ_u)   [N m]"""
    return table.value(theta_u, low, high, t0, t1, t2, t3, t4, t5, t6, t7, t8, t9)


EFFECT = Effect(
    name="position_torque",
    parameters=table.parameters("rad", 0.5, "user position"),
    sentence="a torque that depends on the user's position, between {low:.3g} and {high:.3g} rad, of no known cause",
    separated_by="slow motion over the whole travel in both directions, with and without load",
    laws={"tabulated_torque": torque},
    mistaken_for=("k1",),
    plants=("ema",),
)
