"""The plan of a build: every HF run it needs, as named groups of one long table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from ema.core.names import FAULTS
from ema.faults import N_FAULTS, backlash
from ema.models import hf
from ema.models.actuator import Actuator

from .config import Builder

START_OFFSET = 2e-4  # [rad] stiction holds the user up to about this far from its command


@dataclass(frozen=True)
class Plan:
    """All runs: fault vectors `k` (n, 6), noise `seeds` (n,), `start` states (n, N_STATE); where each group lies."""

    k: np.ndarray
    seeds: np.ndarray
    start: np.ndarray
    groups: dict[str, slice]

    def __len__(self) -> int:
        return len(self.k)


def plan(builder: Builder, plant: Actuator) -> Plan:
    """Lay out the runs; the same configuration gives the same runs, run for run."""
    groups: dict[str, np.ndarray] = {
        "nominal": np.zeros((builder.n_noise, N_FAULTS)),
        "campaign": latin_hypercube(builder.campaign.n_snapshots, builder.campaign.k_max, builder.seed),
    }
    groups["scaled"] = scaled_hypercube(builder.campaign.n_snapshots, builder.campaign.k_max, builder.seed + 2)
    for n, k_max in enumerate(builder.heldout.k_max):
        k = heldout_faults(builder.heldout.n, k_max, builder.seed + 100 + n)
        groups[f"heldout {k_max:g}"] = np.vstack([k, k])
    for j, fault in enumerate(FAULTS):
        for step in builder.jacobian.steps:
            groups[f"step {fault} {step:g}"] = _along(j, step, builder.n_seeds)
    levels = builder.library
    sweeps = [levels.k1_levels, levels.k2_levels, *[levels.phase_levels] * 3, levels.k6_levels]
    for j, (fault, sweep) in enumerate(zip(FAULTS, sweeps, strict=True)):
        for level in sweep:
            groups[f"level {fault} {level:g}"] = _along(j, level, builder.n_seeds)
    groups["start"] = np.zeros((builder.n_start, N_FAULTS))

    k = np.concatenate(list(groups.values()))
    bounds = np.cumsum([0, *map(len, groups.values())])
    slices = {name: slice(int(a), int(b)) for name, a, b in zip(groups, bounds[:-1], bounds[1:], strict=True)}
    start = hf.cold_start(plant, len(k))
    start[slices["start"]] = random_starts(plant, k[slices["start"]], builder.seed + 1)
    seeds = np.random.SeedSequence(builder.seed).generate_state(len(k), np.uint64).astype(np.int64) & (2**62 - 1)
    return Plan(k=k, seeds=seeds, start=start, groups=slices)


def latin_hypercube(n: int, k_max: float, seed: int) -> np.ndarray:
    """Fault vectors within 0…k_max, shape (n, 6)."""
    return qmc.LatinHypercube(N_FAULTS, rng=np.random.default_rng(seed)).random(n) * k_max


def scaled_hypercube(n: int, k_max: float, seed: int) -> np.ndarray:
    """Fault vectors of all sizes alike: within 0…κ, κ log-uniform from k_max/25 to k_max, every other with few faults.

    Shape (n, 6).
    """
    u = qmc.LatinHypercube(N_FAULTS + 1, rng=np.random.default_rng(seed)).random(n)
    k = u[:, :N_FAULTS] * k_max * 25.0 ** (u[:, N_FAULTS:] - 1.0)
    k[::2] = few(k[::2], seed)
    return np.minimum(k, 1.0)


def heldout_faults(n: int, k_max: float, seed: int) -> np.ndarray:
    """Fault vectors to measure model errors on, shape (n, 6): the first half with all faults, the second with few.

    All have one size, ‖k‖ = √2 k_max, the root mean square of vectors drawn from 0…k_max.
    """
    k = latin_hypercube(n, k_max, seed)
    k[n // 2 :] = few(k[n // 2 :], seed)
    return np.minimum(np.sqrt(2.0) * k_max * k / np.linalg.norm(k, axis=1, keepdims=True), 1.0)


def few(k: np.ndarray, seed: int) -> np.ndarray:
    """Of each fault vector of `k` (n, 6) one to three faults alone, scaled to the mean size ‖k‖ of six.

    A fault mostly grows alone, and models err differently there: what is known from vectors with all faults only is
    wrong for such.
    """
    rng = np.random.default_rng(seed)
    kept = np.zeros_like(k)
    for row, full in zip(kept, k, strict=True):
        alone = rng.choice(len(row), rng.integers(1, 4), replace=False)
        row[alone] = full[alone] * np.sqrt(len(row) / len(alone))
    return kept


def random_starts(plant: Actuator, k: np.ndarray, seed: int) -> np.ndarray:
    """Start states at rest, as stiction and backlash leave them, shape (n, N_STATE)."""
    rng = np.random.default_rng(seed)
    gear = rng.uniform(-START_OFFSET, START_OFFSET, len(k))
    gap = rng.uniform(-1.0, 1.0, len(k)) * backlash(plant.transmission.b, k[:, 1])
    return hf.start_at(plant, gear + gap, gear * plant.transmission.GR)


def _along(j: int, level: float, n: int) -> np.ndarray:
    k = np.zeros((n, N_FAULTS))
    k[:, j] = level
    return k
