"""Parameters beside the faults: how often the intervals of 95 % hold the truth, and how far the answers are off.

    python -m benchmarks nuisance

A bundle of the quick configuration that carries the magnets' flux (kept in the cache). Cycles are of this project's HF
model: 200 of each kind, 20 for hf, which is as slow as it is exact.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from ema import bundle
from ema.identification import Measurement, identifier
from ema.models import hf

from .identification import quick_bundle

SEED = 7
PARAMETER = "magnet_flux.change"
SD = 0.05  # of the flux drawn
N = {"linear": 200, "lf2": 200, "lf1": 200, "hf": 20}
LEVEL = 0.95


def nothing(rng: np.random.Generator) -> np.ndarray:
    return np.zeros(6)


def one(rng: np.random.Generator) -> np.ndarray:
    return np.where(np.arange(6) == rng.integers(6), rng.uniform(0.0, 0.08), 0.0)


def all_six(rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(0.0, 0.05, 6)


FAULTS = {"no fault": nothing, "one fault of 0…8 %": one, "six faults of 0…5 %": all_six}


def rows() -> list[dict[str, Any]]:
    b = quick_bundle(nuisance=[PARAMETER])
    return [row for name, draw in FAULTS.items() for row in _rows(b, name, draw)]


def _rows(b: bundle.Bundle, name: str, draw: Any) -> list[dict[str, Any]]:
    rng = np.random.default_rng(SEED)
    n = max(N.values())
    flux = np.clip(SD * rng.standard_normal(n), *(float(side[0]) for side in (b.nuisance.low, b.nuisance.high)))
    k = np.array([draw(rng) for _ in range(n)])
    effects = {"magnet_flux": {"change": flux}}
    seeds = 9 * 10**6 + np.arange(n)
    i = hf.simulate(b.plant, k, seeds=seeds, effects=effects, n_threads=2).envelope[:, b.schedule]
    cycles = [Measurement.complete(row, np.zeros(2)) for row in i]
    return [row for method, m in N.items() for row in _scores(b, method, name, k[:m], flux[:m], cycles[:m])]


def _scores(
    b: bundle.Bundle, method: str, name: str, k: np.ndarray, flux: np.ndarray, cycles: list[Measurement]
) -> list[dict[str, Any]]:
    made = identifier(method, b)
    made.estimate(cycles[0])
    begun = time.process_time()
    estimates = [made.estimate(cycle) for cycle in cycles]
    limits = np.array([e.interval(LEVEL) for e in estimates])
    took = (time.process_time() - begun) / len(k)
    low, high = np.array([e.nuisance.interval95[0] for e in estimates if e.nuisance is not None]).T
    found = np.array([e.nuisance.value[0] for e in estimates if e.nuisance is not None])
    of_flux = (low <= flux) & (flux <= high)
    of_k = (limits[..., 0] <= k) & (k <= limits[..., 1])
    err_k = np.linalg.norm([e.k for e in estimates] - k, axis=1) / 6**0.5
    label = f"{method}, flux ~ N(0, 5 %) and {name}"
    figures = [
        (f"{label}: flux in its 95 % interval, of {len(k)}", float(of_flux.mean()), "1", LEVEL),
        (f"{label}: faults in theirs", float(of_k.mean()), "1", LEVEL),
        (f"{label}: fault that is covered least", float(of_k.mean(axis=0).min()), "1", LEVEL),
        (f"{label}: width of the flux interval", float(np.mean(high - low)), "1", None),
        (f"{label}: rms error of flux", float(np.sqrt(np.mean((found - flux) ** 2))), "1", None),
        (f"{label}: median err_k", float(np.median(err_k)), "1", None),
        (f"{label}: time", 1e3 * took, "ms of CPU", None),
    ]
    return [
        {"figure": figure, "value": value, "unit": unit, "limit": limit, "more": True, "seed": SEED}
        for figure, value, unit, limit in figures
    ]
