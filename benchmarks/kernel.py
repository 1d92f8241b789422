"""The kernels: time per step and run, against the fastest equivalent kernel seen on such a machine (C, AVX-512)."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from ema.core import config, resources
from ema.models import hf, lf1
from ema.models.actuator import Actuator

SEED = 1
BEST_LANES, BEST_SINGLE = 7.4, 55.0  # [ns] 16 runs in lockstep, one run
GEM = 55.0  # [s per simulated s at 1 µs] gym-electric-motor 3.0, measured on such a machine


def _best(f: Callable[[], Any], n: int = 5) -> float:
    f()
    best = np.inf
    for _ in range(n):
        begin = time.perf_counter()
        f()
        best = min(best, time.perf_counter() - begin)
    return best


def rows() -> list[dict[str, Any]]:
    plant = config.load(resources.config("actuator.yaml"), Actuator)
    steps = (plant.n_samples - 1) * 100
    single = _best(lambda: hf.simulate(plant, np.zeros((1, 6)), seeds=SEED))
    lanes = _best(lambda: hf.simulate(plant, np.zeros((16, 6)), seeds=SEED + np.arange(16)))
    simplified = _best(lambda: lf1.simulate(plant, np.zeros((16, 6))))
    duration = plant.motion.duration
    return [
        {"figure": "HF, one run", "value": 1e9 * single / steps, "unit": "ns/step", "limit": BEST_SINGLE, "seed": SEED},
        {"figure": "HF, one run", "value": duration / single, "unit": "× real time", "seed": SEED},
        {"figure": "HF, 16 runs", "value": 1e9 * lanes / steps / 16, "unit": "ns/step/run", "limit": BEST_LANES,
         "seed": SEED},
        {"figure": "HF, 16 runs", "value": 16 * duration / lanes, "unit": "× real time per core",
         "peer": "gym-electric-motor (figure on file)", "peer_value": 1.0 / GEM, "seed": SEED},
        {"figure": "5 000 runs (projected)", "value": 5000 / 16 * lanes, "unit": "s", "limit": 60.0, "seed": SEED},
        {"figure": "LF1, 16 runs", "value": 1e3 * simplified / 16, "unit": "ms/run", "seed": SEED},
    ]  # fmt: skip
