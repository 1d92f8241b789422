"""From an envelope at the schedule to faults with uncertainties.

`identifier(name, bundle)` makes one; all share the interface ``estimate(measurement) -> Estimate`` and are pure:
no I/O, no clock, the same answer for the same measurement.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Protocol

from ema.core.errors import ConfigError

from .estimate import Estimate
from .measurement import Measurement
from .nuisance import NuisanceEstimate

if TYPE_CHECKING:
    from ema.bundle import Bundle

__all__ = ["METHODS", "Estimate", "Identifier", "Measurement", "NuisanceEstimate", "identifier"]

# Where each identifier is made, by a function `make(bundle)`; imported on demand, since some need a JIT.
METHODS = {
    "linear": "ema.identification.linear",
    "lf2": "ema.identification.lf2",
    "lf1": "ema.identification.lf1",
    "hf": "ema.identification.hf",
}


class Identifier(Protocol):
    """One way from a measurement to an estimate."""

    def estimate(self, measurement: Measurement) -> Estimate:
        """Estimate the fault vector of one cycle."""
        ...


def identifier(name: str, bundle: Bundle) -> Identifier:
    """The identifier `name` on a bundle."""
    if name not in METHODS:
        raise ConfigError(f"identifier '{name}' is unknown; known: {', '.join(METHODS)}")
    made: Identifier = import_module(METHODS[name]).make(bundle)
    return made
