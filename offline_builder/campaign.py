"""Run a plan in blocks on any executor; each finished block is a file, so an interrupted build goes on where it was."""

from __future__ import annotations

import hashlib
import os
from collections import deque
from collections.abc import Callable
from concurrent.futures import Executor, Future
from pathlib import Path

import numpy as np

from ema.core.config import digest
from ema.core.errors import BundleError
from ema.models import hf
from ema.models.actuator import Actuator

from .runs import Plan

BLOCK = 128  # runs per task: eight batches of lanes, most of a second's work
N_AHEAD = 64  # tasks submitted and not yet written: with 2.6 MB each, memory stays bounded whatever the campaign


def envelopes(plant: Actuator, k: np.ndarray, seeds: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Envelopes of a block of runs, shape (n, n_t), single precision. [A]"""
    return hf.simulate(plant, k, seeds=seeds, start=start).envelope.astype(np.float32)


def run(
    plan: Plan,
    plant: Actuator,
    work: Path,
    pool: Executor,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> np.ndarray:
    """Run what is not yet in `work`; the result is a memory map, shape (n_runs, n_t).

    The same bits from any number of workers: a run depends on its fault vector, seed and start only.
    """
    work.mkdir(parents=True, exist_ok=True)
    stamp = work / "plan.txt"
    identity = f"{digest(plant)} {_digest(plan)}\n"
    if stamp.exists() and stamp.read_text() != identity:
        raise BundleError(
            f"{work}: holds an unfinished build of another configuration; remove it or choose another --out"
        )
    stamp.write_text(identity)

    blocks = [slice(first, min(first + BLOCK, len(plan))) for first in range(0, len(plan), BLOCK)]
    missing = [block for block in blocks if not _file(work, block).exists()]
    done = len(plan) - sum(block.stop - block.start for block in missing)
    progress(done, len(plan))
    ahead: deque[tuple[slice, Future[np.ndarray]]] = deque()
    waiting = deque(missing)
    try:
        while waiting or ahead:
            while waiting and len(ahead) < N_AHEAD:
                b = waiting.popleft()
                ahead.append((b, pool.submit(envelopes, plant, plan.k[b], plan.seeds[b], plan.start[b])))
            block, future = ahead.popleft()
            unfinished = _file(work, block).with_suffix(".part")
            with open(unfinished, "wb") as file:
                np.save(file, future.result())
            os.replace(unfinished, _file(work, block))
            done += block.stop - block.start
            progress(done, len(plan))
    except BaseException:
        for _, future in ahead:
            future.cancel()
        raise
    return _joined(work, blocks, len(plan), plant.n_samples)


def _joined(work: Path, blocks: list[slice], n: int, n_t: int) -> np.ndarray:
    """All blocks as one memory map, so that memory stays bounded whatever the number of runs."""
    joined = np.lib.format.open_memmap(work / "envelopes.npy", mode="w+", dtype=np.float32, shape=(n, n_t))
    for block in blocks:
        joined[block] = np.load(_file(work, block))
    return joined


def _file(work: Path, block: slice) -> Path:
    return work / f"block_{block.start:08d}.npy"


def _digest(plan: Plan) -> str:
    h = hashlib.sha256()
    for array in (plan.k, plan.seeds, plan.start):
        h.update(np.ascontiguousarray(array).tobytes())
    return h.hexdigest()
