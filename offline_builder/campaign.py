"""Run a plan in blocks on any executor; each finished block is on the disk, so a build can be interrupted."""

from __future__ import annotations

import hashlib
from collections import deque
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future
from pathlib import Path

import numpy as np

from ema.core.config import digest
from ema.core.errors import BundleError
from ema.models import hf
from ema.models.actuator import Actuator

from .runs import Plan
from .snapshots import Snapshots

BLOCK = 128  # runs per task: eight batches of lanes, half a second's work
N_AHEAD = 64  # tasks submitted and not yet written: with 2.6 MB each, memory stays bounded whatever the campaign


def envelopes(plant: Actuator, k: np.ndarray, seeds: np.ndarray, start: np.ndarray, effects: hf.Effects) -> np.ndarray:
    """Envelopes of a block of runs, shape (n, n_t), single precision. [A]"""
    return hf.simulate(plant, k, seeds=seeds, start=start, effects=effects).envelope.astype(np.float32)


def run(
    plan: Plan,
    plant: Actuator,
    work: Path,
    pool: Executor,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> Snapshots:
    """Run what is not yet in the folder `work`.

    The same bits from any number of workers: a run depends on its fault vector, seed and start only.

    Raises
    ------
    BundleError
        The folder holds another campaign, the disk is full, or a worker process died. What is done is kept.
    """
    stamp = work / "plan.txt"
    identity = f"{digest(plant)} {_digest(plan)} {BLOCK}\n"
    if stamp.exists() and stamp.read_text() != identity:
        raise BundleError(
            f"{work}: holds an unfinished build of another configuration; remove it or choose another --out"
        )
    snapshots = Snapshots(work, len(plan), plant.n_samples, BLOCK)
    stamp.write_text(identity)

    waiting = deque(snapshots.missing())
    done = len(plan) - sum(block.stop - block.start for block in waiting)
    progress(done, len(plan))
    ahead: deque[tuple[slice, Future[np.ndarray]]] = deque()
    try:
        while waiting or ahead:
            while waiting and len(ahead) < N_AHEAD:
                b = waiting.popleft()
                effects = plan.nuisance.effects(plan.x[b], plant.effects)
                ahead.append((b, pool.submit(envelopes, plant, plan.k[b], plan.seeds[b], plan.start[b], effects)))
            block, future = ahead.popleft()
            snapshots.write(block, future.result())
            done += block.stop - block.start
            progress(done, len(plan))
    except BrokenExecutor as error:
        raise BundleError(
            f"{work}: a worker process died (out of memory?) after {done} of {len(plan)} runs; "
            "the same command goes on from there"
        ) from error
    finally:
        for _, future in ahead:
            future.cancel()
    return snapshots


def _digest(plan: Plan) -> str:
    h = hashlib.sha256()
    for array in (plan.x, plan.seeds, plan.start, plan.nuisance.scale):
        h.update(np.ascontiguousarray(array).tobytes())
    return h.hexdigest()
