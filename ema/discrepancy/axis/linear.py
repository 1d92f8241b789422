"""What is said of a rotary axis, in the units of a linear one."""

from __future__ import annotations

SAID = {  # the longest first: each is replaced where no longer one was
    "N m s²/rad²": "N s²/m²",
    "N m s^2/rad^2": "N s^2/m^2",
    "N m s/rad": "N s/m",
    "N m/rad": "N/m",
    "rad/(N m)": "m/N",
    "rad per N m": "m per N",
    "1/(N m)": "1/N",
    "kg m²": "kg",
    "kg m^2": "kg",
    "rad/s": "m/s",
    "N m": "N",
    "rad": "m",
    "θ_u": "q",
}


def in_metres(text: str) -> str:
    """A sentence or a unit with metres for radians and newtons for newton metres."""
    if not text:
        return text
    for rotary, linear in SAID.items():
        before, found, after = text.partition(rotary)
        if found:
            return in_metres(before) + linear + in_metres(after)
    return text
