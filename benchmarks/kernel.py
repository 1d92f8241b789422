"""The kernels: time per step and run, against the fastest equivalent kernel on file and other simulators beside it."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from ema.core import config, resources
from ema.discrepancy.actuator.simulating.runs import Work
from ema.effects import registry
from ema.models import hf, lf1
from ema.models.actuator import Actuator

from . import peers

SEED = 1
# An equivalent state machine in C, AVX-512 through `target_clones`, on a Sapphire Rapids at about 2.6 GHz.
BEST_LANES, BEST_SINGLE = 7.4, 55.0  # [ns] 16 runs in lockstep, one run
MISSING = "not installed (extra: bench-peers)"


def _best(work: Callable[[], Any], n: int = 5) -> float:
    """Processor time, the best of `n`. [s]"""
    work()
    best = np.inf
    for _ in range(n):
        began = time.process_time()
        work()
        best = min(best, time.process_time() - began)
    return best


def _sixteen(plant: Actuator, effects: hf.Effects | None = None) -> float:
    """Processor time of one run of sixteen. [s]"""
    return _best(lambda: hf.simulate(plant, np.zeros((16, 6)), seeds=SEED + np.arange(16), effects=effects)) / 16


def costs(work: Work, cpu_s: float) -> dict[str, Any]:
    """What an answer took: runs asked for and simulated, processor time, and that over what full lanes would take."""
    limit = 1e-9 * BEST_LANES * work.steps
    return {"asked": work.asked, "runs": work.simulated, "cpu_s": cpu_s, "times_limit": cpu_s / limit}


def rows() -> list[dict[str, Any]]:
    plant = config.load(resources.config("actuator.yaml"), Actuator)
    steps = (plant.n_samples - 1) * round(1.0 / (plant.control.rate * hf.DT))
    duration = plant.motion.duration
    single = _best(lambda: hf.simulate(plant, np.zeros((1, 6)), seeds=SEED))
    effects = {e.name: {p.name: p.start for p in e.parameters} for e in registry().values() if "ema" in e.plants}
    lanes, dragged = _sixteen(plant), _sixteen(plant, {"viscous_drag": effects["viscous_drag"]})
    library = _sixteen(plant, effects)
    simplified = _best(lambda: lf1.simulate(plant, np.zeros((16, 6)))) / 16
    found = [
        ("HF, one run", 1e9 * single / steps, "ns of CPU/step", BEST_SINGLE, False),
        ("HF, 16 runs as lanes", 1e9 * lanes / steps, "ns of CPU/step/run", BEST_LANES, False),
        ("HF, 16 runs as lanes, with viscous drag", 1e9 * dragged / steps, "ns of CPU/step/run", None, False),
        ("HF, 16 runs as lanes, all effects at once", 1e9 * library / steps, "ns of CPU/step/run", None, False),
        ("HF, 16 runs as lanes", duration / lanes, "× real time per core", hf.DT / (1e-9 * BEST_LANES), True),
        ("Gauss-Newton step with HF (base, 6 columns, 9 seeds)", 16 * lanes, "s of CPU", None, False),
        ("LF1, 16 runs as lanes", 1e3 * simplified, "ms of CPU/run", None, False),
    ]
    table = [
        {"figure": figure, "value": value, "unit": unit, "limit": limit, "more": more, "seed": SEED}
        for figure, value, unit, limit, more in found
    ]
    for name, seconds in peers.measured(plant).items():
        for figure, value in (("one run", single), ("16 runs as lanes, each", lanes)):
            table.append(
                {"figure": f"one second at 1 µs, HF, {figure}", "value": value / duration, "unit": "s of CPU",
                 "peer": name if seconds else f"{name}: {MISSING}", "peer_value": seconds, "seed": SEED}
            )  # fmt: skip
    return table
