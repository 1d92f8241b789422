"""Functions of time as data: what a scenario says of a fault or a temperature.

A number is constant. A list of ``[time, value]`` points is linear between them and constant outside. A mapping
names a shape: ``ramp: {start: 10 s, duration: 30 s, initial: 0, final: 0.2}`` or
``exponential: {start: 0 s, time_constant: 20 s, initial: 0.01, limit: 0.5}``.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Self

from pydantic import Discriminator, Field, RootModel, Tag, field_validator, model_validator

from ema.core.config import Settings, holds_bool
from ema.core.units import LARGEST, quantity, to_unit

Point = tuple[float, float]


class Ramp(Settings):
    """From one value to another at constant speed."""

    start: float = quantity("s", "when it begins", 0.0, ge=0)
    duration: float = quantity("s", "how long it takes", gt=0)
    initial: float = quantity("", "value before", 0.0)
    final: float = quantity("", "value after")

    def at(self, t: float) -> float:
        """Value at the time `t` [s]."""
        return _linear(((self.start, self.initial), (self.start + self.duration, self.final)), t)

    def values(self) -> tuple[float, ...]:
        """The values between which the function stays."""
        return self.initial, self.final


class Exponential(Settings):
    """Growth by the factor e in each time constant, up to a limit."""

    start: float = quantity("s", "when it begins", 0.0, ge=0)
    time_constant: float = quantity("s", "time to grow by the factor e", gt=0)
    initial: float = quantity("", "value before", gt=0)
    limit: float = quantity("", "value never exceeded", gt=0)

    def at(self, t: float) -> float:
        """Value at the time `t` [s]."""
        exponent = max(0.0, t - self.start) / self.time_constant
        return min(self.limit, self.initial * math.exp(min(exponent, 700.0)))

    def values(self) -> tuple[float, ...]:
        """The values between which the function stays."""
        return self.initial, self.limit


class Points(RootModel[Annotated[tuple[Point, ...], Field(min_length=1)]]):
    """Points in time, linear between them."""

    @field_validator("root", mode="before")
    @classmethod
    def _times_with_unit(cls, points: Any) -> Any:
        def seconds(point: Any) -> Any:
            if isinstance(point, list | tuple) and point and isinstance(point[0], str):
                return [to_unit(point[0], "s"), *point[1:]]
            return point

        return [seconds(point) for point in points]

    @field_validator("root")
    @classmethod
    def _increasing(cls, points: tuple[Point, ...]) -> tuple[Point, ...]:
        if not all(abs(x) <= LARGEST for point in points for x in point):
            raise ValueError(f"times and values must be within ±{LARGEST:g}")
        if any(later[0] <= earlier[0] for earlier, later in pairwise(points)):
            raise ValueError("the times must increase")
        return points

    def at(self, t: float) -> float:
        """Value at the time `t` [s]."""
        return _linear(self.root, t)

    def values(self) -> tuple[float, ...]:
        """The values between which the function stays."""
        return tuple(value for _, value in self.root)


class Shape(Settings):
    """A shape with its name; exactly one."""

    ramp: Ramp | None = None
    exponential: Exponential | None = None

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.ramp is None) == (self.exponential is None):
            raise ValueError("name one shape: ramp or exponential")
        return self

    @property
    def named(self) -> Ramp | Exponential:
        """The shape itself."""
        return self.ramp or self.exponential  # type: ignore[return-value]


def _kind(value: Any) -> str:
    if isinstance(value, list | tuple | Points):
        return "points"
    return "shape" if isinstance(value, dict | Shape) else "constant"


class Profile(
    RootModel[
        Annotated[
            Annotated[float, Tag("constant")] | Annotated[Points, Tag("points")] | Annotated[Shape, Tag("shape")],
            Discriminator(_kind),
        ]
    ]
):
    """A function of time with values in `low`…`high`."""

    low: ClassVar[float] = -math.inf
    high: ClassVar[float] = math.inf

    @model_validator(mode="before")
    @classmethod
    def _numbers(cls, value: Any) -> Any:
        if holds_bool(value):
            raise ValueError("true and false are no numbers")
        return value

    @model_validator(mode="after")
    def _within(self) -> Self:
        if not all(self.low <= x <= self.high for x in self.values()):
            raise ValueError(f"values must be within {self.low:g}…{self.high:g}")
        return self

    def at(self, t: float) -> float:
        """Value at the time `t` [s]."""
        root = self.root.named if isinstance(self.root, Shape) else self.root
        return root if isinstance(root, float) else root.at(t)

    def values(self) -> tuple[float, ...]:
        """The values between which the function stays."""
        root = self.root.named if isinstance(self.root, Shape) else self.root
        return (root,) if isinstance(root, float) else root.values()


class FaultProfile(Profile):
    """A fault: 0 healthy, 1 complete failure."""

    low: ClassVar[float] = 0.0
    high: ClassVar[float] = 1.0


class TemperatureProfile(Profile):
    """A temperature. [°C]"""

    low: ClassVar[float] = -60.0
    high: ClassVar[float] = 250.0


def _linear(points: tuple[Point, ...], t: float) -> float:
    if t <= points[0][0]:
        return points[0][1]
    for (t0, x0), (t1, x1) in pairwise(points):
        if t < t1:
            return x0 + (x1 - x0) * (t - t0) / (t1 - t0)
    return points[-1][1]
