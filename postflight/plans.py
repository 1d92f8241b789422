"""What a plant file is of, and what it says of its records' columns."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ema.core import config
from ema.core.errors import ConfigError
from ema.core.sidecar import Sidecar

if TYPE_CHECKING:
    from ema.models.axis_config import Axis

# Which module examines which kind of plant.
EXAMINERS = {"ema": "ema.discrepancy.actuator.examine", "axis": "ema.discrepancy.axis.examine"}


def plan_of(plant_file: Path) -> Sidecar | None:
    """The plant file's key 'record'; None where it has none."""
    said = config.read_yaml(plant_file).get("record")
    return None if said is None else config.validate(said, Sidecar, f"{plant_file}, key 'record'")


def kind_of(plant_file: Path) -> str:
    """`ema` or `axis`; ConfigError where the file says neither."""
    kind = config.read_yaml(plant_file).get("kind")
    if kind not in EXAMINERS:
        raise ConfigError(f"{plant_file}: key 'kind' = {kind!r}: must be one of {', '.join(EXAMINERS)}")
    return str(kind)


def axis_of(plant_file: Path) -> Axis | None:
    """The plant of `kind: axis`; None of an actuator, whose file is only checked."""
    from ema.models import actuator_file, axis_config

    if kind_of(plant_file) == "axis":
        return axis_config.load(plant_file)
    actuator_file.load(plant_file)
    return None
