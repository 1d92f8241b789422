"""Under which conditions a record seems to have been taken, as one value: they are told one by one beside a model."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from .comparators import take_step
from .zeros import take_zero

if TYPE_CHECKING:
    from ema.discrepancy.actuator.simulating.plant import EmaPlant


class Conditions(NamedTuple):
    """What belongs to the bench and its recorder, and is no flaw of the actuator.

    Attributes
    ----------
    step : float, optional
        With which the comparators seem to be evaluated (`comparators`); None: the usual steps. [s]
    late : int
        Samples by which the recorded command is late (`timing`).
    zero : float, optional
        By how much those of rotor and user lie apart (`zeros`); None: open. [rad at the user]
    """

    step: float | None
    late: int
    zero: float | None

    @classmethod
    def of(cls, plant: EmaPlant) -> Conditions:
        """Those with which a plant is simulated now."""
        return cls(plant.step, plant.late, plant.data.zero)

    def take(self, plant: EmaPlant) -> None:
        """Simulate with these from now on."""
        take_step(plant, self.step)
        plant.late = self.late
        take_zero(plant, self.zero)
