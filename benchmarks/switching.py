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


def _local_means(how: dict[str, Any]) -> tuple[np.ndarray, float]:
    """Local means, shape (SEEDS, 3, n) [A], and processor time of a run. [ms]"""
    plant = config.load(resources.config("actuator.yaml"), Actuator)
    hf.simulate(plant, np.tile(FAULTS, (2, 1)), **how)  # compiles
    begun = time.process_time()
    i = hf.simulate(plant, np.tile(FAULTS, (SEEDS, 1)), seeds=np.arange(SEEDS), **how).i
    took = 1e3 * (time.process_time() - begun) / SEEDS
    return i[..., : i.shape[-1] // SHORT * SHORT].reshape(SEEDS, 3, -1, SHORT).mean(axis=-1), took


def rows() -> list[dict[str, Any]]:
    """One row for what is off, and one for what a run costs, by step."""
    fine, _ = _local_means(FINE)
    found = []
    for how in TRIED:
        means, took = _local_means(how)
        one, other = (means[half::2].mean(axis=0) - fine[half::2].mean(axis=0) for half in (0, 1))
        off = 1e3 * np.sqrt(max(float((one * other).mean()), 0.0))
        name = f"HF, {'turns located' if how['located'] else 'asked once'}, step {1e6 * how['dt']:g} µs"
        found += [
            {"figure": f"{name}: means off by", "value": off, "unit": "mA", "seed": f"0…{SEEDS - 1}"},
            {"figure": f"{name}: a run of 0.5 s", "value": took, "unit": "ms"},
        ]
    return found
