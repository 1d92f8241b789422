"""For every hook one function that combines the laws of all effects at that place (see `ema.effects.base`).

The combined functions take the batch array, the lane and the number of lanes, then the hook's own arguments; each
law finds its parameters in the array. They are plain module globals, so that a kernel that calls them can be cached.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit

from ema.effects import HOOKS, registry

from . import jit
from .layout import row

_inline = njit(forceinline=True, fastmath=jit.FAST, error_model="numpy")


def _bind(law: Callable[..., float], first: int, n: int) -> Any:
    """Fix where a law finds its `n` parameters: rows `first`... of the batch array."""
    f = _inline(law)

    @_inline
    def bound(z, l, N, *x):
        return f(*x)

    for place in reversed(range(first, first + n)):
        bound = _given(bound, place)
    return bound


def _given(law: Any, place: int) -> Any:
    """A law that finds its next parameter in this row."""

    @_inline
    def bound(z, l, N, *x):
        return law(z, l, N, *x, z[place * N + l])

    return bound


def _combine(how: str, head: Any, tail: Any) -> Any:
    @_inline
    def total(z, l, N, *x):
        return head(z, l, N, *x) + tail(z, l, N, *x)

    @_inline
    def product(z, l, N, *x):
        return head(z, l, N, *x) * tail(z, l, N, *x)

    return total if how == "sum" else product


def combined(hook: str, plant: str = "ema", row: Callable[[str], int] = row) -> Any:
    """The laws of all effects of `plant` at `hook` as one jitted function; neutral where there is none."""
    how, _ = HOOKS[hook]
    neutral = 0.0 if how == "sum" else 1.0

    @_inline
    def function(z, l, N, *x):
        return neutral

    for name, effect in registry().items():
        if hook in effect.laws and plant in effect.plants:
            first = row(f"{name}.{effect.parameters[0].name}")
            function = _combine(how, _bind(effect.laws[hook], first, len(effect.parameters)), function)
    return function


shaft_torque = combined("shaft_torque")
tabulated_torque = combined("tabulated_torque")
static_friction = combined("static_friction")
sliding_friction = combined("sliding_friction")
user_torque = combined("user_torque")
emf_factor = combined("emf_factor")
resistance_factor = combined("resistance_factor")
inductance_factor = combined("inductance_factor")
angle_error = combined("angle_error")
