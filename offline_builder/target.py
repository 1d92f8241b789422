"""Where a bundle goes: what is there already is not lost unasked."""

from __future__ import annotations

import json
from pathlib import Path

from ema import bundle as bundles
from ema.core import config
from ema.core.errors import BundleError
from ema.models.actuator import Actuator

from .config import Builder


def check(out: Path, builder: Builder, plant: Actuator, replace: bool = False) -> None:
    """BundleError where the folder holds anything but a bundle of this configuration and plant.

    Parameters
    ----------
    out : Path
    builder, plant
        What is to be built.
    replace : bool
        A bundle of another configuration may go; files that are no part of a bundle never do.
    """
    bundles.check_target(out)
    try:
        manifest = json.loads((out / "manifest.json").read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        return
    except (OSError, ValueError):
        manifest = None
    listed = manifest.get("arrays") if isinstance(manifest, dict) else None
    own = {"manifest.json", bundles.SIGNATURE, *(f"{name}.npy" for name in listed or {})}
    foreign = sorted(path.name for path in out.iterdir() if path.name not in own and (listed or path.suffix != ".npy"))
    if foreign:
        more = f" and {len(foreign) - 3} more" if len(foreign) > 3 else ""
        names = ", ".join(foreign[:3]) + more
        raise BundleError(f"{out}: holds files that are none of a bundle ({names}); move them, or choose another --out")
    made = (manifest.get("builder_hash"), manifest.get("plant_hash")) if isinstance(manifest, dict) else None
    if made != (config.digest(builder), config.digest(plant)) and not replace:
        raise BundleError(
            f"{out}: is the bundle of another configuration or plant; choose another --out, or --force to replace it"
        )
