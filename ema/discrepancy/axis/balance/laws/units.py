"""Units in which laws of the balance are told, of axes that turn and of axes that slide."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Units:
    """Of torque, speed and place, and what a torque is called."""

    torque: str
    speed: str
    place: str
    said: str


ROTARY, LINEAR = Units("N m", "rad/s", "rad", "torque"), Units("N", "m/s", "m", "force")


def of_base(u: Units) -> Mapping[str, str]:
    """Units of inertia, dry friction and drag."""
    return {
        "inertia": "kg" if u is LINEAR else "kg m^2",
        "dry_friction": u.torque,
        "viscous_drag": f"{u.torque} s/{u.place}",
    }
