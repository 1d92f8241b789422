"""An actuator's plant file with its effects checked.

`Actuator` alone knows no library of effects: the daemon reads it too, and has no compiler.
"""

from __future__ import annotations

from pathlib import Path

from ema.core import config
from ema.core.errors import ConfigError
from ema.effects import checked

from .actuator import Actuator


def load(path: str | Path) -> Actuator:
    """Read a plant file of `kind: ema`; ConfigError names file, key and what would be right."""
    plant = config.load(path, Actuator)
    try:
        checked(plant.effects, "ema")
    except ValueError as error:
        raise ConfigError(f"{path}: key 'effects': {error}") from error
    return plant
