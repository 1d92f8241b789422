"""Drive compliance: the motor reaches the axis through a gear that gives, and the angle is measured behind it."""

from __future__ import annotations

from .base import NOT_NEGATIVE, POSITIVE, Effect, Parameter
from .gear_compliance import manner

EFFECT = Effect(
    name="drive_compliance",
    parameters=(
        Parameter("compliance", "rad/(N m)", 0.0, 0.0, 10.0, 0.01, "twist of the gear train per torque at the load"),
        Parameter("inertia", "kg m^2", 0.5, 1e-9, 1e5, 0.5, "inertia of the motor, as the load sees it"),
        Parameter("damping", "1", 0.05, 0.005, 0.5, 0.05, "damping ratio; above 1 the load creeps after the motor"),
        Parameter("drag", "N m s/rad", 0.0, 0.0, 1000.0, 5.0, "viscous drag at the motor"),
        Parameter("friction", "N m", 0.0, 0.0, 100.0, 1.0, "dry friction at the motor"),
    ),
    sentence=(
        "the gear train before the measured angle gives {compliance:.2g} rad per N m; "
        "with the motor's {inertia:.2g} kg m² it {manner} "
        "(damping ratio {damping:.2g})"
    ),
    separated_by="fast motion with the angles of motor and load both measured",
    plants=("axis",),
    derived={"manner": manner},
    limits={"inertia": POSITIVE, **dict.fromkeys(("compliance", "damping", "drag", "friction"), NOT_NEGATIVE)},
)
