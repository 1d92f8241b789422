"""The scenario file: which actuators, how their faults grow, what the bus does to their frames."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, Field, model_validator

from ema.bus.identifiers import N_ACTUATORS
from ema.bus.interface import BusSettings, elsewhere
from ema.core import config, resources
from ema.core.config import Settings
from ema.core.errors import ConfigError
from ema.core.units import quantity
from ema.effects import checked
from ema.models import actuator_file
from ema.models.actuator import Actuator

from .profile import FaultProfile, TemperatureProfile

HEALTHY = FaultProfile(0.0)


def probability(meaning: str) -> Any:
    """Field of a probability."""
    return quantity("", f"probability that a frame is {meaning}", 0.0, ge=0, le=1)


class Faults(Settings):
    """Each fault as a function of time; 0 healthy, 1 complete failure."""

    k1: FaultProfile = HEALTHY
    k2: FaultProfile = HEALTHY
    k3: FaultProfile = HEALTHY
    k4: FaultProfile = HEALTHY
    k5: FaultProfile = HEALTHY
    k6: FaultProfile = HEALTHY

    def at(self, t: float) -> list[float]:
        """The fault vector at the time `t` [s]."""
        return [getattr(self, name).at(t) for name in type(self).model_fields]


class ActuatorScenario(Settings):
    """One actuator on the bus."""

    number: int = Field(default=0, ge=0, lt=N_ACTUATORS)
    faults: Faults = Faults()
    temperature: TemperatureProfile = TemperatureProfile(20.0)  # of the winding; acts through effects only
    effects: Annotated[dict[str, dict[str, float]], AfterValidator(lambda effects: checked(effects, "ema"))] = Field(
        default_factory=dict
    )


class Gap(Settings):
    """Frames lost in one stretch of a cycle."""

    cycle: int = Field(ge=0)
    start: float = quantity("s", "time in the cycle", ge=0)
    duration: float = quantity("s", "how long", gt=0)


class Disturbances(Settings):
    """What happens to frames on their way, by chance (probability for each frame) or at a given place."""

    drop: float = probability("left out")
    repeat: float = probability("sent twice")
    corrupt: float = probability("damaged in one bit")
    reorder: float = probability("sent after the next one")
    gaps: tuple[Gap, ...] = ()


class Scenario(Settings):
    """A scenario file."""

    actuator: str = "actuator.yaml"  # plant file, beside the scenario or shipped with the project
    bus: BusSettings = BusSettings()
    period: float = quantity("s", "from the start of one test cycle to the next", 1.0, gt=0, le=86400)
    return_time: float = quantity("s", "to go back to zero after the test motion", 0.25, gt=0, le=60)
    stagger: float = quantity(
        "s", "each actuator begins its test motion so much after the one before it", 0.0, ge=0, le=60
    )
    n_cycles: int | None = Field(default=None, ge=1, description="stop after so many cycles; absent: go on")
    rate: float = Field(default=1.0, gt=0, le=1000, description="scenario time over real time")
    seed: int = Field(default=0, ge=0)
    noise: bool = True
    allow_injection: bool = False
    actuators: tuple[ActuatorScenario, ...] = (ActuatorScenario(),)
    disturbances: Disturbances = Disturbances()

    @model_validator(mode="after")
    def _numbers_differ(self) -> Scenario:
        numbers = [a.number for a in self.actuators]
        if not numbers or len(set(numbers)) < len(numbers):
            raise ValueError(f"actuators: each needs a number of its own, got {numbers}")
        return self


def load(path: str | Path) -> tuple[Scenario, Actuator]:
    """A scenario and its plant; ConfigError when either is wrong or they do not fit together."""
    scenario = config.load(path, Scenario)
    beside, shipped = Path(path).parent / scenario.actuator, resources.config(scenario.actuator)
    plant = actuator_file.load(shipped if shipped.exists() and not beside.exists() else beside)
    least = plant.motion.duration + scenario.return_time + scenario.stagger * (len(scenario.actuators) - 1)
    if scenario.period < least:
        raise ConfigError(
            f"{path}: key 'period' = {scenario.period:g}: must be at least {least:g} s (test motion and way back, "
            "of the last actuator if they are staggered)"
        )
    return scenario, plant


def override(scenario: Scenario, bus: str | None, rate: float | None, n_cycles: int | None) -> Scenario:
    """The scenario with what the command line says otherwise."""
    place = bus and elsewhere(scenario.bus, bus)
    said = {"bus": place, "rate": rate, "n_cycles": n_cycles}
    return scenario.model_copy(update={key: value for key, value in said.items() if value})
