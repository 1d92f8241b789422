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


def combined(hook: str, plant: str = "ema", row: Callable[[str], int] = row) -> Any:
    """The laws of all effects of `plant` at `hook` as one jitted function; neutral where there is none.

    It is written out as one expression: a function around each law and each of its parameters takes longer to compile
    than the equations themselves.
    """
    how, n_arguments = HOOKS[hook]
    x = ", ".join(f"x{j}" for j in range(n_arguments))
    sign, total = ("+", "0.0") if how == "sum" else ("*", "1.0")
    laws: dict[str, Any] = {}
    for name, effect in registry().items():
        if hook in effect.laws and plant in effect.plants:
            laws[name] = _inline(effect.laws[hook])
            values = ", ".join(f"z[{row(f'{name}.{p.name}')} * N + l]" for p in effect.parameters)
            total = f"{name}({x}, {values}) {sign} ({total})"
    exec(f"def {hook}(z, l, N, {x}):\n    return {total}", laws)
    return _inline(laws[hook])


shaft_torque = combined("shaft_torque")
tabulated_torque = combined("tabulated_torque")
static_friction = combined("static_friction")
sliding_friction = combined("sliding_friction")
user_torque = combined("user_torque")
emf_factor = combined("emf_factor")
resistance_factor = combined("resistance_factor")
inductance_factor = combined("inductance_factor")
angle_error = combined("angle_error")
