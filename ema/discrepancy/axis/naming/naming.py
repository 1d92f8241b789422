"""Names of free parameters and what they mean to the axis model.

==========================  ===============================================================
``F_d``, ``J``, ``k_t`` …   a parameter of the plant file
``stribeck.speed``          a parameter of a library effect
``cogging:72.cos``          cosine (sine) part of the cogging line of 72 periods per turn
``gear_error:14.17.cos``    the same of a gear's line, of an external torque, or of a line along a travel
``position_line:262.order`` its own order, where that is fitted too
``term1.coefficient``       a column of an unnamed term (`ema.effects.torque_term`)
``zero:NAME``               angle to be added to the positions of record NAME
==========================  ===============================================================
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ema.models.axis_config import INSTANCE, LINES

if TYPE_CHECKING:
    from ema.discrepancy.plant import Point

OF_MOTION = ("position_delay", "speed_delay", "resolver_error", "encoder_error")  # effects of its sensors
PARAMETERS = ("J", "M", "C", "F_d", "k_t", "k_e", "R", "L")


@dataclass(frozen=True)
class Numbers:
    """A point, sorted. `lines` has the key of each line among the effects by its name there, as ``cogging:72``."""

    parameters: dict[str, float]
    effects: dict[str, dict[str, float]]
    terms: list[dict[str, float]]
    zeros: dict[str, float]
    lines: dict[str, str]

    def like(self, key: str, other: Numbers) -> dict[str, float] | None:
        """What another point has of an effect of this one: of a line, that of the same name, whatever its number."""
        name = next((name for name, own in self.lines.items() if own == key), None)
        return other.effects.get(key if name is None else other.lines.get(name, ""))


def line(order: float, part: str, effect: str = "cogging") -> str:
    """Name of one part of a line of torque."""
    return f"{effect}:{order:.8g}.{part}"


def numbers_of(point: Point) -> Numbers:
    """Sort a point's values by what they mean."""
    parameters: dict[str, float] = {}
    effects: dict[str, dict[str, float]] = {}
    terms: dict[str, dict[str, float]] = {}
    zeros: dict[str, float] = {}
    lines: dict[tuple[str, float], dict[str, float]] = {}
    for name, value in point.items():
        head, _, tail = name.rpartition(".")
        if name.startswith("zero:"):
            zeros[name.removeprefix("zero:")] = value
        elif name.startswith(tuple(f"{effect}:" for effect in LINES)):
            effect, _, n = head.partition(":")
            lines.setdefault((effect, float(n)), {})[tail] = value
        elif name.startswith("term"):
            terms.setdefault(head, {})[tail] = value
        elif head:
            effects.setdefault(head, {})[tail] = value
        else:
            parameters[name] = value
    keys: dict[str, str] = {}
    for (effect, order), parts in sorted(lines.items()):
        number = 1 + sum(key.split(INSTANCE)[0] == effect for key in effects)
        key = effect if number == 1 else f"{effect}{INSTANCE}{number}"
        effects[key] = torque_line(parts.get("order", order), parts.get("cos", 0.0), parts.get("sin", 0.0))
        keys[f"{effect}:{order:.8g}"] = key
    return Numbers(parameters, effects, list(terms.values()), zeros, keys)


def torque_line(order: float, cos: float, sin: float) -> dict[str, float]:
    """Amplitude and phase:  c cos nθ + s sin nθ = A sin(nθ + φ)"""
    return {"amplitude": float(np.hypot(cos, sin)), "order": order, "phase": float(np.arctan2(cos, sin))}
