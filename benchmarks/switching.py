"""What the HF model's means over many seeds owe to its step, with comparators asked once a step and located within it.

Local means of the phase currents are held against steps of 0.25 µs with located turns; products of two halves of the
seeds, so that chance adds nothing. Part of `python -m benchmarks`.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from ema.core import config, resources
from ema.models import hf
from ema.models.actuator import Actuator

SEEDS, SHORT = 96, 25  # runs; samples of a local mean
FAULTS = np.array([0.05, 0.02, 0.0, 0.1, 0.05, 0.3])
FINE = {"located": True, "dt": 2.5e-7}
TRIED: list[dict[str, Any]] = [
    *({"located": False, "dt": dt} for dt in (1.25e-7, 2.5e-7, 5e-7, 1e-6, 2e-6)),
    *({"located": True, "dt": dt} for dt in (1e-6, 2e-6, 4e-6, 5e-6)),
]


def local_means(plant: Actuator, n: int, **how: Any) -> np.ndarray:
    """Local means of the phase currents of runs with seeds of their own, shape (n, 3, n_means). [A]"""
    i = hf.simulate(plant, np.tile(FAULTS, (n, 1)), seeds=np.arange(n), **how).i
    return i[..., : i.shape[-1] // SHORT * SHORT].reshape(n, 3, -1, SHORT).mean(axis=-1)


def common_difference(some: np.ndarray, others: np.ndarray) -> float:
    """Rms of what means over all runs differ by, of products of two halves of the runs: chance adds nothing. [A]"""
    one, other = (some[half::2].mean(axis=0) - others[half::2].mean(axis=0) for half in (0, 1))
    return float(np.sqrt(max(float((one * other).mean()), 0.0)))


def rows() -> list[dict[str, Any]]:
    """One row for what is off, and one for what a run costs, by step."""
    plant = config.load(resources.config("actuator.yaml"), Actuator)
    fine = local_means(plant, SEEDS, **FINE)
    found = []
    for how in TRIED:
        local_means(plant, 2, **how)  # compiles
        begun = time.process_time()
        means = local_means(plant, SEEDS, **how)
        took = 1e3 * (time.process_time() - begun) / SEEDS
        off = 1e3 * common_difference(means, fine)
        name = f"HF, {'turns located' if how['located'] else 'asked once'}, step {1e6 * how['dt']:g} µs"
        found += [
            {"figure": f"{name}: means off by", "value": off, "unit": "mA", "seed": f"0…{SEEDS - 1}"},
            {"figure": f"{name}: a run of 0.5 s", "value": took, "unit": "ms"},
        ]
    return found
