"""Friction that grows with the load at the output: what a gear loses of the torque it passes on, whoever drives.

Structural: the axis model takes the load, what opposes it at rest besides friction, from its own equations. Of what
moves, the part beyond the gear is a load too, with the torque that accelerates it.
"""

from __future__ import annotations

from collections.abc import Mapping

from numba import njit

from .base import NOT_NEGATIVE, PART, Effect, Parameter


@njit(inline="always")
def passed_on(load, net, direction, share, of_inertia):
    """Torque y that a gear passes on, without its sign, to a `load` and a share of the moving inertia.   [N m or N]

    J dω/dt = net - direction share |y|,  y = load + of_inertia J dω/dt;  `net` is all else that acts, friction too.
    """
    y = load + of_inertia * net
    return abs(y) / (1.0 + of_inertia * share * (direction if y > 0.0 else -direction))


def passed(values: Mapping[str, float]) -> str:
    """What a gear passes on besides the load."""
    return f" and to {values['of_inertia']:.0%} of the inertia" if values["of_inertia"] > 0.0 else ""


EFFECT = Effect(
    name="output_load_friction",
    parameters=(
        Parameter("share", "1", 0.0, 0.0, 1.0, 0.1, "friction per torque that is passed on"),
        Parameter("of_inertia", "1", 0.0, 0.0, 1.0, 1.0, "share of the moving inertia that is beyond the gear"),
    ),
    sentence="friction grows with the torque passed on to the load{passed}, by {share:.3g} of it (what the gear loses)",
    separated_by="the same motion with different loads",
    mistaken_for=("k1",),
    plants=("axis",),
    derived={"passed": passed},
    limits={"share": NOT_NEGATIVE, "of_inertia": PART},
)
