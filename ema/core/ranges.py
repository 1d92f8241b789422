"""Numbers on the command line."""

from __future__ import annotations

import math
from typing import Any

import click


class FiniteRange(click.FloatRange):
    """A number within a range; never NaN, which lies in every range, and infinite only where that has a meaning."""

    def __init__(self, *args: Any, infinite: bool = False, **kwargs: Any):
        super().__init__(*args, **kwargs)
        self._infinite = infinite

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """See click."""
        number = float(super().convert(value, param, ctx))
        if math.isnan(number) or (math.isinf(number) and not self._infinite):
            self.fail(f"{value!r} is not a {'number' if self._infinite else 'finite number'}", param, ctx)
        return number
