"""What a plant file says of its records' columns."""

from __future__ import annotations

from pathlib import Path

from ema.core import config
from ema.core.sidecar import Sidecar


def plan_of(plant_file: Path) -> Sidecar | None:
    """The plant file's key 'record'; None where it has none."""
    said = config.read_yaml(plant_file).get("record")
    return None if said is None else config.validate(said, Sidecar, f"{plant_file}, key 'record'")
