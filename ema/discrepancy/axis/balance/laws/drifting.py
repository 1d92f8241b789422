"""What drifts: friction with time within a cycle; friction and magnets with the temperature where one was recorded."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ema.core.records import Array

from .law import Columns, Law, one
from .motion import Motion

WARMED = 5.0  # [K] of temperature that records must cover
LOST = tuple(np.geomspace(0.003, 0.06, 8).tolist())  # [1/K]


def drift_laws(m: Motion, torque: str, place: str) -> Iterator[Law]:
    """Dry and viscous friction over time, and over temperature."""
    begin, span = float(m.t.min()), float(np.ptp(m.t)) or 1.0
    drag = f"{torque} s/{place}"
    after = f"from the start of a cycle to its end, {span:.3g} s later"

    def late(m: Motion) -> Array:
        return (m.t - begin) / span

    kinds: tuple[tuple[str, str, str, Columns], ...] = (
        ("friction_drift", "dry friction", torque, lambda m, _: (m.direction * late(m),)),
        ("viscous_drift", "viscous friction", drag, lambda m, _: (m.w * late(m),)),
    )
    for name, what, unit, columns in kinds:
        yield Law(
            name,
            name,
            name,
            columns,
            {"change": unit},
            one("change", begin=begin, span=span),
            f"{what} changes by {{change:+.3g}} {unit} {after} (as it warms up)",
            "the same motion cold and warm, with a temperature recorded",
            is_friction=True,
        )
    if float(np.ptp(m.dT)) < WARMED:
        return
    yield Law(
        "magnets by temperature",
        "magnets by temperature",
        "magnet_flux",
        lambda m, acting: (-acting.motor * m.dT,),
        {"per_kelvin": "1/K"},
        one("per_kelvin"),
        "the torque per current changes by {per_kelvin:+.3%} per kelvin of the recorded temperature",
        "voltage at a known speed, cold and warm",
        needs_acting=True,
    )
    for k in LOST:
        for name, what, unit, columns in (
            ("friction_by_temperature", "dry friction", torque, _dry(k)),
            ("viscous_by_temperature", "viscous friction", drag, _viscous(k)),
        ):
            yield Law(
                name,
                f"{name} {k:.3g}",
                name,
                columns,
                {"at_20_celsius": unit, "per_kelvin": "1/K"},
                one("at_20_celsius", per_kelvin=k),
                f"{what} falls with the recorded temperature, {{at_20_celsius:.3g}} {unit} at 20 °C, "
                "by {per_kelvin:.2%} per kelvin",
                "the same motion cold and warm, and once more after the axis has cooled down",
                is_friction=True,
            )


def _dry(k: float) -> Columns:
    """sign ω [exp(-k ΔT) - 1]"""
    return lambda m, _: (m.direction * np.expm1(-k * m.dT),)


def _viscous(k: float) -> Columns:
    """ω [exp(-k ΔT) - 1]"""
    return lambda m, _: (m.w * np.expm1(-k * m.dT),)
