"""What several folders' tests need: the shipped plant and codec, a small bundle, simulated traffic."""

from __future__ import annotations

import functools
import importlib
import os
import subprocess
import zlib

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as in the daemon: on thirty equations threads only spin

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from ema_offline_builder.build import build
from ema_offline_builder.config import Builder
from ema_simulator.disturb import disturb
from ema_simulator.injection import FaultSource
from ema_simulator.node import cycles
from ema_simulator.scenario import Scenario
from ema_simulator.traffic import Traffic
from hypothesis import settings
from xdist.scheduler import LoadScopeScheduling

from ema import bundle
from ema.bus import codec
from ema.core import config, resources
from ema.models.actuator import Actuator

settings.register_profile("ema", deadline=None)  # how long a shared machine takes is nothing that a test asserts
settings.load_profile("ema")

EPOCH_NS = 1_700_000_000_000_000_000


@pytest.fixture(scope="session")
def shipped_plant() -> Actuator:
    return config.load(resources.config("actuator.yaml"), Actuator)


class Beside(LoadScopeScheduling):
    """`make test`: the search for hidden effects beside all that shares clocks, ports and a multicast group.

    Attacks go file by file: each daemon has a bus and a folder of its own.
    """

    def _split_scope(self, nodeid):
        if nodeid.startswith("tests/adversary/"):
            return nodeid.split("::")[0]
        return nodeid if nodeid.startswith("tests/discrepancy/") else "one by one"


SHARE = 8  # `--searches drawn`: one in so many of the further searches, others with each commit


def pytest_addoption(parser):
    parser.addoption(
        "--searches",
        choices=("few", "drawn", "all"),
        default="all",
        help="tests marked `further`: none, all, or those that the commit draws",
    )


def pytest_collection_modifyitems(config, items):
    """Every further search is run with some commit, without each commit waiting for all."""
    how = config.getoption("--searches")
    if how == "all":
        return
    left = [item for item in items if item.get_closest_marker("further") and not (how == "drawn" and _is_drawn(item))]
    items[:] = [item for item in items if item not in left]
    config.hook.pytest_deselected(items=left)


@functools.cache
def _commit() -> bytes:
    return subprocess.check_output(["git", "rev-parse", "HEAD"], cwd=Path(__file__).parent).strip()


def _is_drawn(item) -> bool:
    return zlib.crc32(_commit() + item.nodeid.encode()) % SHARE == 0


def pytest_xdist_make_scheduler(config, log):
    return Beside(config, log)


COARSE = {
    "plant": "actuator.yaml",
    "seed": 11,
    "campaign": {"n_snapshots": 120, "k_max": 0.3},
    "heldout": {"n": 40, "k_max": [0.05, 0.2]},
    "n_seeds": 12,
    "n_noise": 120,
    "n_start": 80,
    "jacobian": {"steps": [0.03, 0.06]},
    "library": {
        "k1_levels": [0.1, 0.3, 0.6],
        "k2_levels": [0.05, 0.15, 0.4, 0.8],
        "phase_levels": [0.05, 0.15, 0.3],
        "k6_levels": [0.1, 0.3, 0.6],
        "degree_f2": 2,
    },
}


def built(plant, folder, **changes):
    """A bundle built in a few seconds: coarser than the quick one, good enough to see a fault."""
    with ThreadPoolExecutor(2) as pool:
        build(Builder.model_validate(COARSE | changes), plant, folder / "bundle", pool)
    return bundle.load(folder / "bundle")


@pytest.fixture(scope="session")
def coarse_bundle(shipped_plant, tmp_path_factory):
    """Of the shipped plant."""
    return built(shipped_plant, tmp_path_factory.mktemp("coarse"))


@pytest.fixture(scope="session")
def flux_bundle(shipped_plant, tmp_path_factory):
    """The same, which carries the magnets' flux beside the faults."""
    more = {"campaign": {"n_snapshots": 400, "k_max": 0.3}, "nuisance": ["magnet_flux.change"]}
    return built(shipped_plant, tmp_path_factory.mktemp("flux"), **more)


@pytest.fixture(scope="session")
def support() -> Callable[[str], ModuleType]:
    """Loads a module of tests/support by its name (`pythonpath` in pyproject.toml)."""
    return importlib.import_module


@pytest.fixture(scope="session")
def hidden(support) -> ModuleType:
    """The independent actuator with flaws to hide (tests/support/hidden_actuator.py)."""
    return support("hidden_actuator")


@pytest.fixture(scope="session")
def fly(shipped_plant):
    """Simulates a scenario: per cycle its true data and its frames, stamped as if received at the scenario's time."""
    made: dict[str, list] = {}

    def run(**scenario):
        key = repr(scenario)
        if key not in made:
            made[key] = list(_flight(Scenario.model_validate(scenario), shipped_plant))
        return [(cycle, frames.copy()) for cycle, frames in made[key]]

    return run


def _flight(scenario, plant):
    shared = codec.default()
    traffic = Traffic(shared, [a.number for a in scenario.actuators], scenario.stagger)
    rng = np.random.default_rng(scenario.seed)
    for cycle in cycles(scenario, plant, FaultSource(scenario, shared)):
        frames, due = traffic.frames(cycle, scenario.period)
        frames, due = disturb(frames, due, cycle.number, scenario.disturbances, rng)
        frames["t_ns"] = EPOCH_NS + np.round(1e9 * (cycle.t_start + due)).astype(np.int64)
        yield cycle, frames
