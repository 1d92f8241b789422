"""The offline phase from configuration to bundle."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

from ema import bundle as bundles
from ema.bundle import Bundle
from ema.core import config
from ema.models import actuator_file
from ema.models.actuator import Actuator

from . import campaign, target
from .analysis import analyse
from .claim import claimed
from .config import Builder
from .nuisance import resolve
from .runs import plan


def read(path: Path) -> tuple[Builder, Actuator]:
    """The builder's configuration and the plant it names."""
    builder = config.load(path, Builder)
    return builder, actuator_file.load(path.parent / builder.plant)


def build(
    builder: Builder,
    plant: Actuator,
    out: Path,
    pool: Executor,
    progress: Callable[[int, int], None] = lambda done, of: None,
    say: Callable[[str], None] = lambda text: None,
    replace: bool = False,
    key: Ed25519PrivateKey | None = None,
) -> Bundle:
    """Run (or resume) the campaign and write the bundle; the work folder is removed when the bundle stands.

    A bundle of another configuration is only replaced where `replace` says so. With a `key` the bundle is signed.
    """
    target.check(out, builder, plant, replace)
    work = out.with_name(out.name + ".work")
    with claimed(work):
        nuisance = resolve(builder, plant)
        runs = plan(builder, plant, nuisance)
        envelopes = campaign.run(runs, plant, work, pool, progress)
        arrays, figures = analyse(envelopes, runs, plant, builder, say)
        facts: dict[str, Any] = {"builder_hash": config.digest(builder), "figures": figures}
        if len(nuisance):
            facts["nuisance"] = nuisance.as_list()
        made = bundles.save(out, plant, builder.model_dump(mode="json"), arrays, key, **facts)
        shutil.rmtree(work)
    return made
