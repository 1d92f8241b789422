"""The plan of a build: every HF run it needs, as named groups of one long table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from ema.core.names import FAULTS
from ema.faults import N_FAULTS, backlash
from ema.identification.nuisance import NONE, Nuisance
from ema.models import hf
from ema.models.actuator import Actuator

from .config import Builder

START_OFFSET = 2e-4  # [rad] stiction holds the user up to about this far from its command


@dataclass(frozen=True)
class Plan:
    """All runs: points `x` = [k; ν] (n, 6 + m), noise `seeds` (n,), `start` states (n, N_STATE); where groups lie."""

    x: np.ndarray
    seeds: np.ndarray
    start: np.ndarray
    groups: dict[str, slice]
    nuisance: Nuisance

    @property
    def k(self) -> np.ndarray:
        """Fault vectors, shape (n, 6)."""
        return self.x[:, :N_FAULTS]

    def __len__(self) -> int:
        return len(self.x)


def plan(builder: Builder, plant: Actuator, nuisance: Nuisance = NONE) -> Plan:
    """Lay out the runs; the same configuration gives the same runs, run for run."""
    d = N_FAULTS + len(nuisance)
    low, high = nuisance.bounds
    groups: dict[str, np.ndarray] = {
        "nominal": np.zeros((builder.n_noise, d)),
        "campaign": latin_hypercube(builder.campaign.n_snapshots, builder.campaign.k_max, builder.seed, d),
    }
    groups["scaled"] = scaled_hypercube(builder.campaign.n_snapshots, builder.campaign.k_max, builder.seed + 2, d)
    for n, k_max in enumerate(builder.heldout.k_max):
        x = heldout_points(builder.heldout.n, k_max, builder.seed + 100 + n, d)
        groups[f"heldout {k_max:g}"] = np.vstack([x, x])
    for j, fault in enumerate(FAULTS):
        for step in builder.jacobian.steps:
            groups[f"step {fault} {step:g}"] = _along(j, step, builder.n_seeds, d)
    for j, name in enumerate(nuisance.names, N_FAULTS):
        for sign in (1.0, -1.0):
            groups[f"step {name} {sign:+g}"] = _along(j, sign * builder.jacobian.steps[-1], builder.n_seeds, d)
    levels = builder.library
    sweeps = [levels.k1_levels, levels.k2_levels, *[levels.phase_levels] * 3, levels.k6_levels]
    for j, (fault, sweep) in enumerate(zip(FAULTS, sweeps, strict=True)):
        for level in sweep:
            groups[f"level {fault} {level:g}"] = _along(j, level, builder.n_seeds, d)
    groups["start"] = np.zeros((builder.n_start, d))
    groups["start, faulty"] = np.vstack([groups[f"heldout {k_max:g}"][rows] for k_max, rows in paired(builder)])

    x = np.clip(np.concatenate(list(groups.values())), low, high)
    bounds = np.cumsum([0, *map(len, groups.values())])
    slices = {name: slice(int(a), int(b)) for name, a, b in zip(groups, bounds[:-1], bounds[1:], strict=True)}
    start = hf.cold_start(plant, len(x))
    for n, name in ((1, "start"), (4, "start, faulty")):
        start[slices[name]] = random_starts(plant, x[slices[name]], builder.seed + n)
    seeds = np.random.SeedSequence(builder.seed).generate_state(len(x), np.uint64).astype(np.int64) & (2**62 - 1)
    return Plan(x=x, seeds=seeds, start=start, groups=slices, nuisance=nuisance)


def paired(builder: Builder) -> list[tuple[float, np.ndarray]]:
    """Which held-out faults are run again from random starts: rows of each k_max, both of many and of few."""
    n, sets = builder.heldout.n, builder.heldout.k_max
    each = min(-(-builder.n_start // len(sets)), n)
    return [(k_max, np.linspace(0, n - 1, each).astype(int)) for k_max in sets]


def latin_hypercube(n: int, k_max: float, seed: int, d: int = N_FAULTS) -> np.ndarray:
    """Points with faults within 0…k_max and nuisance parameters within ±k_max, shape (n, d)."""
    return _centred(qmc.LatinHypercube(d, rng=np.random.default_rng(seed)).random(n)) * k_max


def scaled_hypercube(n: int, k_max: float, seed: int, d: int = N_FAULTS) -> np.ndarray:
    """The same of all sizes alike: within 0…κ, κ log-uniform from k_max/25 to k_max, every other with few elements.

    Shape (n, d).
    """
    u = qmc.LatinHypercube(d + 1, rng=np.random.default_rng(seed)).random(n)
    x = _centred(u[:, :d]) * k_max * 25.0 ** (u[:, d:] - 1.0)
    x[::2] = few(x[::2], seed)
    return np.minimum(x, 1.0)


def _centred(u: np.ndarray) -> np.ndarray:
    """Unit hypercube → faults in 0…1, nuisance parameters in ±1."""
    return np.hstack([u[:, :N_FAULTS], 2.0 * u[:, N_FAULTS:] - 1.0])


def heldout_points(n: int, k_max: float, seed: int, d: int = N_FAULTS) -> np.ndarray:
    """Points to measure model errors on, shape (n, d): the first half with all elements, the second with few.

    All have one size, ‖x‖ = √(d/3) k_max, the root mean square of vectors drawn from 0…k_max.
    """
    x = latin_hypercube(n, k_max, seed, d)
    x[n // 2 :] = few(x[n // 2 :], seed)
    return np.minimum(np.sqrt(d / 3.0) * k_max * x / np.linalg.norm(x, axis=1, keepdims=True), 1.0)


def few(x: np.ndarray, seed: int) -> np.ndarray:
    """Of each point of `x` (n, d) one to three elements alone, scaled to the mean size ‖x‖ of all.

    A fault mostly grows alone, and models err differently there: what is known from vectors with all faults only is
    wrong for such.
    """
    rng = np.random.default_rng(seed)
    kept = np.zeros_like(x)
    for row, full in zip(kept, x, strict=True):
        alone = rng.choice(len(row), rng.integers(1, 4), replace=False)
        row[alone] = full[alone] * np.sqrt(len(row) / len(alone))
    return kept


def random_starts(plant: Actuator, k: np.ndarray, seed: int) -> np.ndarray:
    """Start states at rest, as stiction and backlash leave them, shape (n, N_STATE)."""
    rng = np.random.default_rng(seed)
    gear = rng.uniform(-START_OFFSET, START_OFFSET, len(k))
    gap = rng.uniform(-1.0, 1.0, len(k)) * backlash(plant.transmission.b, k[:, 1])
    return hf.start_at(plant, gear + gap, gear * plant.transmission.GR)


def _along(j: int, level: float, n: int, d: int) -> np.ndarray:
    x = np.zeros((n, d))
    x[:, j] = level
    return x
