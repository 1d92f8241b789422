"""What a search for candidates and the balance need of an axis with its records."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from ema.core.records import Array, Record
    from ema.discrepancy.plant import Free, Point
    from ema.models import axis
    from ema.models.axis_config import Axis

    from .windows import Bench, Window


@dataclass(frozen=True)
class Zero:
    """Angle to be added to the positions of a record, found by lines of `orders`; None where nothing tells. [rad]

    `turned`: lines that have the other sign in this record while the zero is the same; a zero that is `instead` off
    would look alike, where there is one.
    """

    angle: float | None
    orders: tuple[float, ...] = ()
    turned: tuple[float, ...] = ()
    instead: float | None = None

    @property
    def period(self) -> float:
        """Angle by multiples of which the zero may be another. [rad]"""
        return 2.0 * math.pi / math.gcd(*(round(n) for n in self.orders))


class Measured(Protocol):
    """An axis with its records, cut into windows; see `finding.plant.AxisPlant`."""

    plant: Axis
    between: str
    records: tuple[Record, ...]
    benches: tuple[Bench, ...]
    windows: tuple[Window, ...]
    zeros: dict[str, Zero]
    plays: dict[tuple[object, ...], Array | None]

    @property
    def left_by_balance(self) -> float:
        """Mean square that the balance of torque leaves, over what noise makes of it; infinite where there is none."""
        ...

    @property
    def base(self) -> Sequence[Free]:
        """Parameters free in every model."""
        ...

    def bench_of(self, block: int) -> Bench:
        """The record a block belongs to."""
        ...

    def model(self, point: Point) -> axis.Model:
        """The kernel's numbers at a point."""
        ...

    def residuals(self, points: Sequence[Point], blocks: Sequence[int]) -> list[list[Array]]:
        """Whitened residuals by point and block."""
        ...
