"""Configuration of the offline phase."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, field_validator

from ema.core.config import Settings
from ema.core.units import quantity


def _ascending(values: list[float]) -> list[float]:
    if any(b <= a for a, b in pairwise(values)):
        raise ValueError("must be ascending, each value once")
    return values


Levels = Annotated[list[Annotated[float, Field(gt=0, le=1)]], AfterValidator(_ascending)]


class Campaign(Settings):
    """Latin hypercube of fault vectors for POD and model errors."""

    n_snapshots: int = Field(ge=20, le=10_000_000, description="fault vectors n_s")
    k_max: float = quantity("", "largest fault drawn", gt=0, le=1)


class Heldout(Settings):
    """Faults that no model is fitted to, each run twice: how far models are from the truth, by size of the faults."""

    n: int = Field(ge=20, le=100_000, description="fault vectors for each k_max")
    k_max: Levels = Field(min_length=2, max_length=20, description="largest fault drawn, ascending")


class Jacobian(Settings):
    """Finite differences at k = 0."""

    steps: Levels = Field(min_length=1, max_length=10, description="candidate steps, ascending")
    signal_to_noise: float = quantity(
        "", "a step is taken if ‖Δi‖ exceeds its noise this many times", 10.0, gt=1, le=1e3
    )


class Library(Settings):
    """Levels at which the LF2 library is simulated, and its polynomials."""

    k1_levels: Levels = Field(min_length=1)
    k2_levels: Levels = Field(min_length=1)
    phase_levels: Levels = Field(min_length=1)
    k6_levels: Levels = Field(min_length=1)
    degree_f1: int = Field(default=2, ge=1, le=5)
    degree_f2: int = Field(default=3, ge=1, le=5)


class Schedule(Settings):
    """How the sampling points are chosen."""

    method: Literal["som", "uniform", "qr", "greedy"] = "som"
    n_points: int = Field(default=30, ge=6, le=500)


class NuisanceParameter(Settings):
    """A parameter of an effect that the monitor estimates beside the faults; in the parameter's own unit."""

    parameter: str = Field(pattern=r"^\w+\.\w+$", description="effect.parameter")
    low: float | None = Field(default=None, description="bound; the effect's own if not given")
    high: float | None = Field(default=None, description="bound; the effect's own if not given")
    sd: float | Literal["interval"] | None = Field(
        default=None,
        description="standard deviation known beforehand, about the plant's value; 'interval': from the plant's "
        "interval of 95 %, as `ema discrepancy` wrote it; if not given, anything within the bounds is as likely",
    )


class Builder(Settings):
    """The whole offline phase."""

    plant: str = Field(description="file of the actuator, relative to this file")
    seed: int = Field(ge=0, description="everything random derives from it")
    campaign: Campaign
    heldout: Heldout
    n_seeds: int = Field(ge=2, le=10_000, description="runs averaged for each step and level")
    n_noise: int = Field(ge=40, le=100_000, description="nominal runs for the switching-noise covariance")
    n_start: int = Field(ge=40, le=100_000, description="runs from random start states")
    jacobian: Jacobian
    library: Library
    schedule: Schedule = Schedule()
    nuisance: list[NuisanceParameter] = Field(
        default_factory=list, max_length=4, description="what is estimated beside the faults: effect.parameter, …"
    )

    @field_validator("nuisance", mode="before")
    @classmethod
    def _plain_names(cls, value: Any) -> Any:
        return [{"parameter": v} if isinstance(v, str) else v for v in value] if isinstance(value, list) else value
