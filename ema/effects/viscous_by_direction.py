"""Viscous friction that differs by direction: wipers and films of grease that build up better one way."""

from __future__ import annotations

from .base import Effect, Parameter


def torque(theta_m, w_m, theta_u, i_q, difference):
    """τ = c_d |ω|: with the drag C ω it is (C + c_d) ω forwards and (C - c_d) ω backwards   [N m]"""
    return difference * abs(w_m)


EFFECT = Effect(
    name="viscous_by_direction",
    parameters=(
        Parameter(
            "difference", "N m s/rad", 0.0, -2e-3, 2e-3, 5e-5, "viscous coefficient in positive direction over the mean"
        ),
    ),
    sentence="viscous friction differs by direction: {difference:+.3g} N m s/rad in positive, the opposite in negative",
    separated_by="constant speeds in both directions",
    laws={"shaft_torque": torque},
    mistaken_for=("k1",),
    plants=("axis",),
)
