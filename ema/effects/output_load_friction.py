"""Friction that grows with the load at the output: what a gear loses of the torque it passes on, whoever drives.

Structural: the axis model takes the load, what opposes it at rest besides friction, from its own equations.
"""

from __future__ import annotations

from .base import NOT_NEGATIVE, Effect, Parameter

EFFECT = Effect(
    name="output_load_friction",
    parameters=(Parameter("share", "1", 0.0, 0.0, 1.0, 0.1, "friction per load torque"),),
    sentence="friction grows with the load at the output, by {share:.3g} of it (what the gear loses)",
    separated_by="the same motion with different loads",
    mistaken_for=("k1",),
    plants=("axis",),
    limits={"share": NOT_NEGATIVE},
)
