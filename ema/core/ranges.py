"""Numbers on the command line."""

from __future__ import annotations

import math
from typing import Any

import click


class FiniteRange(click.FloatRange):
    """A number within a range; never NaN, which lies in every range, and infinite only where that has a meaning."""

    def __init__(self, *args: Any, infinite: bool = False, unit: str | None = None, **kwargs: Any):
        super().__init__(*args, **kwargs)
        self._infinite = infinite
        self._unit = unit  # a text such as 0.5mH is taken too

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """See click."""
        number = float(super().convert(self._without_unit(value, param, ctx), param, ctx))
        if math.isnan(number) or (math.isinf(number) and not self._infinite):
            self.fail(f"{value!r} is not a {'number' if self._infinite else 'finite number'}", param, ctx)
        return number

    def _without_unit(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if self._unit is None or not isinstance(value, str):
            return value
        try:
            float(value)
        except ValueError:
            from ema.core.units import to_unit

            try:
                return to_unit(value, self._unit)
            except ValueError as error:
                self.fail(str(error), param, ctx)
        return value
