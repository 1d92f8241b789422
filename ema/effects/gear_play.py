"""Play of a gear: motor and load turn freely against each other within a gap, and meet at its ends.

Where teeth meet they are a spring and a damper that only push. Of the speed at which they met, a share is left when
they part, the coefficient of restitution (Schwager and Pöschel 2007, doi:10.1007/s10035-007-0065-z):

    e = exp(-2 ζ / √(1 - ζ²) arccos ζ)
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from numba import njit

from .base import NOT_NEGATIVE, PART, POSITIVE, Effect, Parameter

CONTACT = 10.0  # compliance where teeth meet, over the least that is stable
NEARLY_ONE = 1.0 - 1e-9


@njit(inline="always")
def through(twist, slip, stiffness, damping, gap):
    """Torque through a gear with a gap: of a spring and a damper beyond its ends, which only push.   [N m]"""
    if gap == 0.0:
        return stiffness * twist + damping * slip
    beyond = twist - min(max(twist, -0.5 * gap), 0.5 * gap)
    if beyond == 0.0:
        return 0.0
    T = stiffness * beyond + damping * slip
    return max(T, 0.0) if beyond > 0.0 else min(T, 0.0)


def where(values: Mapping[str, float]) -> str:
    """What is behind the gap, as seen from the angle that is measured."""
    return "motor" if values["driven"] > 0.0 else "load"


def restitution(values: Mapping[str, float]) -> float:
    """Share of the speed at which teeth meet that is left when they part."""
    zeta = min(values["damping"], NEARLY_ONE)
    return math.exp(-2.0 * zeta / math.sqrt(1.0 - zeta * zeta) * math.acos(zeta))


EFFECT = Effect(
    name="gear_play",
    parameters=(
        Parameter("gap", "rad", 0.0, 0.0, 1.0, 0.01, "angle within which it turns freely, where it is measured"),
        Parameter("inertia", "kg m^2", 0.5, 1e-9, 1e5, 0.5, "inertia behind the gap"),
        Parameter("friction", "N m", 0.0, 0.0, 1e5, 1.0, "dry friction behind the gap"),
        Parameter("damping", "1", 0.25, 0.0, 1.0, 0.25, "damping ratio where teeth meet"),
        Parameter(
            "compliance", "rad/(N m)", 0.0, 0.0, 10.0, 0.01, "twist where teeth meet; 0: as stiff as a step allows"
        ),
        Parameter("driven", "1", 0.0, 0.0, 1.0, 0.0, "1 where the motor is behind the gap, 0 where the load is"),
    ),
    sentence=(
        "the gear has a play of {gap:.2g} rad before the {where}, {inertia:.2g} kg m² there "
        "(coefficient of restitution {restitution:.2g})"
    ),
    separated_by="reversals with the angles of motor and load both measured",
    plants=("axis",),
    derived={"where": where, "restitution": restitution},
    limits={
        "inertia": POSITIVE,
        "gap": NOT_NEGATIVE,
        "friction": NOT_NEGATIVE,
        "damping": PART,
        "driven": PART,
        "compliance": NOT_NEGATIVE,
    },
)
