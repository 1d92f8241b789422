"""Errors, intervals and times of the identifiers, with a bundle of the quick configuration (kept in the cache).

Test sets are 100 fault vectors of this project's HF model (20 for hf), and 40 of the independent simulation in
tests/support/hidden_actuator.py, cold and with carried state, every other with one fault alone.
"""

from __future__ import annotations

import os
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import hidden_actuator as hidden
import numpy as np
import platformdirs
from ema_offline_builder import build
from ema_offline_builder.config import Builder

from ema import bundle
from ema.core import resources
from ema.core.config import digest
from ema.identification import Measurement, identifier
from ema.models import hf
from ema.models.actuator import Actuator
from ema.models.envelope import envelope
from ema.models.jit import equations_digest

SEED = 5
SETS = (0.05, 0.1, 0.3, 0.5)
AIM = {("linear", "U(0, 0.05)"): 0.012, ("hf", "U(0, 0.05)"): 0.006, ("hf", "U(0, 0.3)"): 0.006}
TIME_AIM = {"linear": 10.0, "hf": 1000.0}  # [ms]
LEVELS = (0.5, 0.9, 0.95)
N, N_HF, N_INDEPENDENT = 100, 20, 40


def quick_bundle(plant: Actuator | None = None, **changes: Any) -> bundle.Bundle:
    """Of the quick configuration with other values of some of its keys; of another plant than the shipped one."""
    builder, shipped = build.read(resources.config("builder-quick.yaml"))
    plant = plant or shipped
    builder = Builder.model_validate(builder.model_dump(mode="json") | changes)
    name = f"bench-{bundle.VERSION}-{equations_digest()}-{digest(builder)[:12]}-{digest(plant)[:12]}"
    path = Path(platformdirs.user_cache_dir("ema")) / name
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
            build.build(builder, plant, path, pool)
    return bundle.load(path)


def rows() -> list[dict[str, Any]]:
    b = quick_bundle()
    table: list[dict[str, Any]] = []
    for k_max in SETS:
        k = np.random.default_rng(SEED).uniform(0.0, k_max, (N, 6))
        x = hf.simulate(b.plant, k, seeds=10**6 + np.arange(N), n_threads=2).envelope[:, b.schedule]
        cycles = [Measurement.complete(row, np.zeros(2)) for row in x]
        for method in ("linear", "lf2", "lf1", "hf"):
            n = N_HF if method == "hf" else N
            table += _rows(b, method, f"U(0, {k_max:g})", k[:n], cycles[:n])
    for name, carried in (("cold", False), ("state carried", True)):
        k, cycles = independent(b, carried)
        for method in ("linear", "lf2", "hf"):
            table += _rows(b, method, f"independent, {name}", k, cycles)
    return table


def _rows(b: bundle.Bundle, method: str, name: str, k: np.ndarray, cycles: list[Measurement]) -> list[dict[str, Any]]:
    made = identifier(method, b)
    made.estimate(cycles[0])
    begin = time.perf_counter()
    estimates = [made.estimate(cycle) for cycle in cycles]
    seconds = (time.perf_counter() - begin) / len(k)
    err = np.linalg.norm([e.k for e in estimates] - k, axis=1) / 6**0.5
    null = float(np.median(np.linalg.norm(k, axis=1) / 6**0.5))
    label = f"{method}, {name}"
    table = [
        {"figure": f"{label}: median err_k of {len(k)}", "value": float(np.median(err)), "unit": "1",
         "limit": AIM.get((method, name)), "peer": "null, k̂ = 0", "peer_value": null, "seed": SEED},
        {"figure": f"{label}: time", "value": 1e3 * seconds, "unit": "ms", "limit": TIME_AIM.get(method)},
    ]  # fmt: skip
    for level in LEVELS:
        low, high = np.moveaxis(np.array([e.interval(level) for e in estimates]), -1, 0)
        within = ((k >= low) & (k <= high)).mean(axis=1)
        error = within.std(ddof=1) / np.sqrt(len(k))
        figure = f"{label}: in {100 * level:g} % interval (± {error:.3f})"
        table.append({"figure": figure, "value": float(within.mean()), "unit": "1", "limit": level})
    rejected = float(np.mean([e.p_value < 0.01 for e in estimates]))
    return [*table, {"figure": f"{label}: test of fit, p < 0.01", "value": rejected, "unit": "1", "limit": 0.01}]


def independent(b: bundle.Bundle, carried: bool) -> tuple[np.ndarray, list[Measurement]]:
    """Fault vectors (40, 6), every other with one fault alone, and what another program's actuator shows of them."""
    rng = np.random.default_rng(SEED)
    k = rng.uniform(0.0, 0.15, (N_INDEPENDENT, 6))
    for n in range(0, N_INDEPENDENT, 2):
        k[n] = np.where(np.arange(6) == n // 2 % 6, rng.uniform(0.0, 0.4), 0.0)
    return k, [_cycle(b, row, n, carried) for n, row in enumerate(k)]


def _cycle(b: bundle.Bundle, k: np.ndarray, seed: int, carried: bool) -> Measurement:
    flaws = hidden.Flaws(*k)
    record = hidden.cycles(flaws, 2 if carried else 1, seed + SEED * 1000, (b.plant.command(),))[-1]
    i = np.array([record[name] for name in ("i_a", "i_b", "i_c")])
    start = np.array([record["theta_u"][0], record["theta_m"][0] / b.plant.transmission.GR])
    return Measurement.complete(envelope(i, b.rate)[b.schedule], start)
