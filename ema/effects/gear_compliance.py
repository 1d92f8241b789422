"""Gear compliance: the gear train is a spring between the motor and an inertia at the user.

On an actuator that inertia is added to J_m, and the spring begins where the play ends; on an axis it is a part of J.
"""

from __future__ import annotations

from collections.abc import Mapping

from .base import NOT_NEGATIVE, POSITIVE, Effect, Parameter


def manner(values: Mapping[str, float]) -> str:
    """What hangs to a spring does."""
    return "resonates" if values["damping"] < 1.0 else "creeps after the motor"


EFFECT = Effect(
    name="gear_compliance",
    parameters=(
        Parameter("compliance", "rad/(N m)", 0.0, 0.0, 0.01, 3e-05, "twist of the gear train per torque at the user"),
        Parameter("inertia", "kg m^2", 0.5, 0.001, 10.0, 0.5, "inertia at the user"),
        Parameter("damping", "1", 0.05, 0.005, 0.5, 0.05, "damping ratio; above 1 the user creeps after the motor"),
        Parameter("drag", "N m s/rad", 0.0, 0.0, 1000.0, 5.0, "viscous drag at the user"),
        Parameter("friction", "N m", 0.0, 0.0, 100.0, 1.0, "dry friction at the user"),
    ),
    sentence=(
        "the gear train gives {compliance:.2g} rad per N m; with {inertia:.2g} kg m² at the user it {manner} "
        "(damping ratio {damping:.2g})"
    ),
    separated_by="fast motion with the angles of motor and load both measured",
    mistaken_for=("k2",),
    plants=("ema", "axis"),
    derived={"manner": manner},
    product=("inertia", "compliance"),
    limits={"inertia": POSITIVE, **dict.fromkeys(("compliance", "damping", "drag", "friction"), NOT_NEGATIVE)},
)
