"""A drive whose torque per current differs by polarity: one half bridge or one side of a sensor that is off."""

from __future__ import annotations

from .base import Effect, Parameter


def torque(theta_m, w_m, theta_u, i_q, per_ampere):
    """τ = c |i|: of the torque k_t i, c is added one way and taken the other   [N m]"""
    return per_ampere * abs(i_q)


EFFECT = Effect(
    name="drive_unequal",
    parameters=(
        Parameter("per_ampere", "N m/A", 0.0, -1.0, 1.0, 0.001, "torque lost with positive and gained with negative"),
    ),
    sentence="one polarity of the drive gives more than the other: what opposes it has a part of {per_ampere:+.3g} "
    "N m/A times the size of the current, whichever its sign",
    separated_by="the same motions with the drive's polarity reversed",
    laws={"shaft_torque": torque},
    mistaken_for=("k1",),
    plants=("axis",),
)
