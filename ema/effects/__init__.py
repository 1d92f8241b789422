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

__all__ = ["HOOKS", "Effect", "Parameter", "checked", "known", "registry"]


@cache
def registry() -> MappingProxyType[str, Effect]:
    """Every effect of this folder by name, in alphabetical order (order carries no meaning)."""
    modules = sorted(module.name for module in pkgutil.iter_modules(__path__))
    found = (getattr(importlib.import_module(f"{__name__}.{name}"), "EFFECT", None) for name in modules)
    return MappingProxyType({effect.name: effect for effect in found if effect is not None})


def checked(effects: Mapping[str, Mapping[str, float]], plant: str) -> Mapping[str, Mapping[str, float]]:
    """Values of effects as a file gives them, if they are `known` and a model can simulate them; else ValueError."""
    for name, values in known(effects, plant).items():
        effect = registry()[name]
        full = {**effect.neutral(), **values}
        for parameter, limit in effect.limits.items():
            if not limit.holds(full[parameter]):
                raise ValueError(f"effect '{name}': {parameter} = {full[parameter]:g} must be {limit.says}")
        if effect.is_table and not full["low"] < full["high"]:
            raise ValueError(f"effect '{name}': low = {full['low']:g} must be below high = {full['high']:g}")
    return effects


def known(effects: Mapping[str, Mapping[str, V]], plant: str) -> Mapping[str, Mapping[str, V]]:
    """Values of effects, if all of them exist for a plant (``ema`` or ``axis``) and are finite; else ValueError."""
    for name, values in effects.items():
        there = [n for n, effect in registry().items() if plant in effect.plants]
        if name not in there:
            raise ValueError(f"effect '{name}' is unknown; known for kind {plant}: {', '.join(there)}")
        has = [p.name for p in registry()[name].parameters]
        for parameter, value in values.items():
            if parameter not in has:
                raise ValueError(f"effect '{name}' has no parameter '{parameter}'; it has: {', '.join(has)}")
            if not np.all(np.isfinite(value)):
                raise ValueError(f"effect '{name}': {parameter} = {value} is not finite")
    return effects
