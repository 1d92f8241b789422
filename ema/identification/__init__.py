"""From an envelope at the schedule to faults with uncertainties.

`identifier(name, bundle)` makes one; all share the interface ``estimate(measurement) -> Estimate`` and are pure:
no I/O, no clock, the same answer for the same measurement.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Protocol

from ema.core.errors import ConfigError
from ema.core.names import METHODS

from .estimate import Estimate
from .measurement import Measurement
from .nuisance import NuisanceEstimate
from .unbounded import Unbounded

if TYPE_CHECKING:
    from ema.bundle import Bundle

__all__ = ["METHODS", "Estimate", "Identifier", "Measurement", "NuisanceEstimate", "Unbounded", "identifier"]


class Identifier(Protocol):
    """One way from a measurement to an estimate."""

    def estimate(self, measurement: Measurement) -> Estimate:
        """Estimate the fault vector of one cycle."""
        ...


def identifier(name: str, bundle: Bundle) -> Identifier:
    """The identifier `name` on a bundle."""
    if name not in METHODS:
        raise ConfigError(f"identifier '{name}' is unknown; known: {', '.join(METHODS)}")
    made: Identifier = import_module(f"{__name__}.{name}").make(bundle)  # on demand, since some need a JIT
    return made
