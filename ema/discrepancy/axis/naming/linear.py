"""What is said of an effect, for an axis: it has no user apart from it, and a linear one has metres and newtons."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ema.effects.base import Effect

SAID = {  # of those that begin alike the longest first
    "N m s²/rad²": "N s²/m²",
    "N m s^2/rad^2": "N s^2/m^2",
    "N m s/rad^2": "N s/m^2",
    "N m s/rad": "N s/m",
    "N m/rad": "N/m",
    "rad/(N m)": "m/N",
    "rad per N m": "m per N",
    "1/(N m)": "1/N",
    "kg m²": "kg",
    "kg m^2": "kg",
    "N m/A": "N/A",
    "1/rad": "1/m",
    "rad/s": "m/s",
    "rad/m": "rad/m",  # of an angle that is none of the axis
    "N m": "N",
    "rad": "m",
    "θ_u": "q",
}


# Of a drive whose own torque or force is recorded, what is per ampere of a current is a share.
RECORDED = {"N m/A of the current": "of the {drive}", "N m/A": "1"}
UNITS = {"current": "A", "voltage": "V", "force": "N", "torque": "N m"}


def by_drive(text: str, drive: str) -> str:
    """A sentence or a unit of what the drive is, or is in proportion to: there is one, and not always a current."""
    if drive in ("force", "torque"):
        for said, instead in RECORDED.items():
            text = text.replace(said, instead.format(drive=drive))
    if drive in UNITS:
        text = text.replace("drive (current, voltage or force)", drive).replace("A, V or N", UNITS[drive])
    return text


APART = {
    " at the user it": " behind it, it",
    " at the user": "",
    "θ_u": "θ_m",
}  # of those that begin alike the longest first


def of_axis(text: str, *, linear: bool) -> str:
    """A sentence or a unit of an effect, as it is said of an axis."""
    if linear:
        text = in_metres(text)
    for said, instead in APART.items():
        text = text.replace(said, instead)
    return text


def units_of(effect: Effect, said: Callable[[str], str]) -> dict[str, str]:
    """Units of an effect's parameters, as they are said; a phase is no angle of the axis."""
    return {p.name: p.unit if p.name == "phase" else said(p.unit) for p in effect.parameters}


def in_metres(text: str) -> str:
    """A sentence or a unit with metres for radians and newtons for newton metres."""
    return re.sub("|".join(map(re.escape, SAID)), lambda found: SAID[found[0]], text)
