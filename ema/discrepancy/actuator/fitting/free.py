"""Parameters that a fit may move."""

from __future__ import annotations

from dataclasses import dataclass

from ema.core.names import FAULTS
from ema.effects import registry

K_STEP = 0.03  # below, the switching noise of a difference is as large as the difference


@dataclass(frozen=True)
class Free:
    """A parameter to be fitted: its bounds and the step of its finite difference."""

    name: str
    low: float
    high: float
    step: float


def goes_with_temperature(name: str) -> bool:
    """Whether a parameter acts in proportion to each cycle's temperature."""
    return name.endswith(".per_kelvin")


K_FREE = tuple(Free(name, 0.0, 1.0, K_STEP) for name in FAULTS)


def free(name: str, step: float | None = None) -> Free:
    """A free parameter of an effect, by its registered bounds; the step from where a search begins."""
    effect, parameter = name.split(".")
    p = next(p for p in registry()[effect].parameters if p.name == parameter)
    return Free(name, p.low, p.high, step if step is not None else (p.start - p.neutral) or 0.1 * (p.high - p.low))
