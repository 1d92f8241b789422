"""One physical term per file; `registry()` finds them. Adding an effect is adding a file that defines `EFFECT`."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import TypeVar

import numpy as np

from . import wide_vectors  # noqa: F401 - before anything is jitted
from .base import HOOKS, Effect, Parameter

V = TypeVar("V", bound="float | np.ndarray")

__all__ = ["HOOKS", "Effect", "Parameter", "checked", "registry"]


@cache
def registry() -> MappingProxyType[str, Effect]:
    """Every effect of this folder by name, in alphabetical order (order carries no meaning)."""
    modules = sorted(module.name for module in pkgutil.iter_modules(__path__))
    found = (getattr(importlib.import_module(f"{__name__}.{name}"), "EFFECT", None) for name in modules)
    return MappingProxyType({effect.name: effect for effect in found if effect is not None})


def checked(effects: Mapping[str, Mapping[str, V]], plant: str) -> Mapping[str, Mapping[str, V]]:
    """Values of effects, if all of them exist for a plant (``ema`` or ``axis``) and are finite; else ValueError."""
    for name, values in effects.items():
        known = [n for n, effect in registry().items() if plant in effect.plants]
        if name not in known:
            raise ValueError(f"effect '{name}' is unknown; known for kind {plant}: {', '.join(known)}")
        has = [p.name for p in registry()[name].parameters]
        for parameter, value in values.items():
            if parameter not in has:
                raise ValueError(f"effect '{name}' has no parameter '{parameter}'; it has: {', '.join(has)}")
            if not np.all(np.isfinite(value)):
                raise ValueError(f"effect '{name}': {parameter} = {value} is not finite")
    return effects
