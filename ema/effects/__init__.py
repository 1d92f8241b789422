"""One physical term per file; `registry()` finds them. Adding an effect is adding a file that defines `EFFECT`."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache
from types import MappingProxyType

from . import wide_vectors  # noqa: F401 - before anything is jitted
from .base import HOOKS, Effect, Parameter

__all__ = ["HOOKS", "Effect", "Parameter", "registry"]


@cache
def registry() -> MappingProxyType[str, Effect]:
    """Every effect of this folder by name, in alphabetical order (order carries no meaning)."""
    modules = sorted(module.name for module in pkgutil.iter_modules(__path__))
    found = (getattr(importlib.import_module(f"{__name__}.{name}"), "EFFECT", None) for name in modules)
    return MappingProxyType({effect.name: effect for effect in found if effect is not None})
