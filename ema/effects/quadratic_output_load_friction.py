"""Friction that grows with the square of the load at the output.

Structural: the axis model takes the load, what opposes it at rest besides friction, from its own equations.
"""

from __future__ import annotations

from .base import NOT_NEGATIVE, Effect, Parameter

EFFECT = Effect(
    name="quadratic_output_load_friction",
    parameters=(Parameter("per_torque", "1/(N m)", 0.0, 0.0, 20.0, 0.1, "friction per load torque squared"),),
    sentence="friction grows with the square of the load at the output, by {per_torque:.3g} of it per N m",
    separated_by="the same motion with different loads",
    mistaken_for=("k1",),
    plants=("axis",),
    limits={"per_torque": NOT_NEGATIVE},
)
