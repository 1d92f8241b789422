"""Errors of the identifiers on test sets of 100, with a bundle of the quick configuration (kept in the cache)."""

from __future__ import annotations

import os
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
from ema_offline_builder import build

from ema import bundle
from ema.core import resources
from ema.core.config import digest
from ema.identification import Measurement, identifier
from ema.models import hf
from ema.models.jit import equations_digest

SEED = 5
SETS = (0.05, 0.1, 0.3, 0.5)
AIM = {("linear", 0.05): 0.012, ("hf", 0.05): 0.006, ("hf", 0.3): 0.006}
N, N_HF = 100, 20


def quick_bundle() -> bundle.Bundle:
    builder, plant = build.read(resources.config("builder-quick.yaml"))
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
        for method in ("linear", "lf2", "lf1", "hf"):
            n = N_HF if method == "hf" else N
            made = identifier(method, b)
            begin = time.perf_counter()
            found = np.array([made.estimate(Measurement.complete(row, np.zeros(2))).k for row in x[:n]])
            seconds = (time.perf_counter() - begin) / n
            err = np.linalg.norm(found - k[:n], axis=1) / 6**0.5
            null = float(np.median(np.linalg.norm(k[:n], axis=1) / 6**0.5))
            name = f"{method}, U(0, {k_max:g})"
            table += [
                {"figure": f"{name}: median err_k of {n}", "value": float(np.median(err)), "unit": "1",
                 "limit": AIM.get((method, k_max)), "peer": "null, k̂ = 0", "peer_value": null, "seed": SEED},
                {"figure": f"{name}: time", "value": 1e3 * seconds, "unit": "ms"},
            ]  # fmt: skip
    return table
