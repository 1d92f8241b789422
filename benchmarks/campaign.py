"""The offline phase at scale: runs on all cores, tasks' overhead, POD, memory.

    python -m benchmarks campaign                                   in the bench's table, 5 000 runs
    python -m benchmarks.campaign --runs 100000 --workers 2         one campaign and its POD, with the memory it took

The second prints the peak of resident memory on the way: of this process, and of all its workers together.
"""

from __future__ import annotations

import argparse
import os
import resource
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg
from ema_offline_builder import campaign
from ema_offline_builder.executors import executor
from ema_offline_builder.runs import Plan, latin_hypercube

from ema.core import config, resources
from ema.identification.nuisance import NONE
from ema.models import hf
from ema.models.actuator import Actuator
from ema.reduction.pod import pod

SEED = 41
N_RUNS = 5000
K_MAX = 0.5
N_TASKS = 200
AIM = 30.0  # for 5 000 runs on two cores [s]


def rows() -> list[dict[str, Any]]:
    plant = config.load(resources.config("actuator.yaml"), Actuator)
    workers = os.cpu_count() or 1
    i0 = hf.simulate(plant, np.zeros((16, 6)), seeds=SEED + np.arange(16)).envelope.mean(axis=0)
    with tempfile.TemporaryDirectory() as name:
        began = time.perf_counter()
        with executor(workers) as pool:
            snapshots = campaign.run(_plan(plant, N_RUNS), plant, Path(name), pool)
        took = time.perf_counter() - began
        found = [
            {"figure": f"campaign of {N_RUNS} runs, {workers} processes and their start", "value": took, "unit": "s",
             "limit": AIM, "seed": SEED},
            {"figure": "  share of the processors' time in use", "value": _share(took, workers), "unit": "1"},
        ]  # fmt: skip
        found += _overheads()
        full = snapshots[:]
        seconds, modes = _timed(lambda: pod(snapshots, i0))
        seconds_full, v1 = _timed(lambda: scipy.linalg.svd(full.astype(float) - i0, full_matrices=False)[2][0])
    apart = abs(1.0 - abs(float(v1 @ modes.v[:, 0])))
    return [
        *found,
        {"figure": f"POD of {N_RUNS} × {len(i0)} from the disk, 10 modes", "value": seconds, "unit": "s of CPU",
         "peer": "full SVD (LAPACK)", "peer_value": seconds_full, "seed": SEED},
        {"figure": "  |1 - |cosine|| of its first mode and the full SVD's", "value": apart, "unit": "1"},
    ]  # fmt: skip


def large(n: int, workers: int, scheduler: str | None, folder: Path | None) -> None:
    """One campaign and its POD; prints times and memory."""
    plant = config.load(resources.config("actuator.yaml"), Actuator)
    i0 = hf.simulate(plant, np.zeros((16, 6)), seeds=SEED + np.arange(16)).envelope.mean(axis=0)
    with tempfile.TemporaryDirectory(dir=folder) as name, _memory() as memory:
        began, marks = time.perf_counter(), iter(np.linspace(0.1, 1.0, 10))
        mark = next(marks)

        def progress(done: int, of: int) -> None:
            nonlocal mark
            if done >= mark * of:
                print(f"  {done:8d} runs {time.perf_counter() - began:7.1f} s   {memory}", flush=True)
                mark = next(marks, 2.0)

        with executor(workers, scheduler) as pool:
            snapshots = campaign.run(_plan(plant, n), plant, Path(name), pool, progress)
        took = time.perf_counter() - began
        size = sum(path.stat().st_size for path in Path(name).iterdir())
        print(f"campaign of {n} runs: {took:.1f} s, {1e3 * took / n:.2f} ms a run; {size / 1e9:.2f} GB on the disk")
        for part in (n // 10, n):
            seconds, modes = _timed(lambda part=part: pod(snapshots.part(slice(0, part)), i0))
            print(f"POD of {part} × {len(i0)}: {seconds:.1f} s of CPU, λ1 share {modes.share[0]:.4f}; {memory}")
        print(f"largest resident memory of this process (ru_maxrss): {_peak():.0f} MB; seed {SEED}")


def _plan(plant: Actuator, n: int) -> Plan:
    k = latin_hypercube(n, K_MAX, SEED)
    return Plan(k, SEED + np.arange(n), hf.cold_start(plant, n), {"campaign": slice(0, n)}, NONE)


def _timed(work: Callable[[], Any]) -> tuple[float, Any]:
    began = time.process_time()
    made = work()
    return time.process_time() - began, made


def _share(took: float, workers: int) -> float:
    """CPU time of the ended worker processes over what the cores had to give: near 1 if nothing else ran."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (used.ru_utime + used.ru_stime) / (took * workers)


def _overheads() -> list[dict[str, Any]]:
    """Time of a task that does nothing; `campaign.BLOCK` runs are one task."""
    found = []
    with executor(1) as pool:
        found.append(("worker process", _empty(pool)))
    try:
        from distributed import LocalCluster
    except ImportError:
        found.append(("Dask (not installed: extra `cluster`)", None))
    else:
        here = {"dashboard_address": None, "host": "127.0.0.1"}
        with (
            LocalCluster(n_workers=1, threads_per_worker=1, **here) as cluster,
            executor(scheduler=cluster.scheduler_address) as pool,
        ):
            found.append(("Dask, local cluster", _empty(pool)))
    what = f"overhead of a task (a task is {campaign.BLOCK} runs)"
    return [{"figure": f"{what}: {name}", "value": value, "unit": "ms"} for name, value in found]


def _empty(pool: Executor) -> float:
    pool.submit(abs, 0).result()
    began = time.perf_counter()
    for future in [pool.submit(abs, n) for n in range(N_TASKS)]:
        future.result()
    return 1e3 * (time.perf_counter() - began) / N_TASKS


class _Memory:
    """Resident memory, now and at its largest. [B]"""

    def __init__(self) -> None:
        self.own = self.all = self.own_peak = self.all_peak = 0

    def look(self) -> None:
        """Look at this process and its children."""
        me = os.getpid()
        sizes = {pid: _rss(pid) for pid in [me, *_children(me)]}
        self.own, self.all = sizes[me], sum(sizes.values())
        self.own_peak, self.all_peak = max(self.own_peak, self.own), max(self.all_peak, self.all)

    def __str__(self) -> str:
        return (
            f"resident {self.own / 1e6:.0f} MB (peak {self.own_peak / 1e6:.0f}), "
            f"with workers {self.all / 1e6:.0f} MB (peak {self.all_peak / 1e6:.0f})"
        )


@contextmanager
def _memory() -> Iterator[_Memory]:
    """Looked at five times a second."""
    memory, over = _Memory(), threading.Event()

    def watch() -> None:
        while not over.wait(0.2):
            memory.look()

    thread = threading.Thread(target=watch)
    thread.start()
    try:
        yield memory
    finally:
        over.set()
        thread.join()


def _children(pid: int) -> list[int]:
    found: list[int] = []
    for task in Path(f"/proc/{pid}/task").iterdir():
        found += map(int, (task / "children").read_text().split())
    return found


def _rss(pid: int) -> int:
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, IndexError):  # has just ended
        return 0


def _peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=100_000)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--scheduler", help="address of a Dask scheduler, instead of worker processes")
    parser.add_argument("--folder", type=Path, help="where there is room for 20 kB a run (default: the system's)")
    options = parser.parse_args()
    large(options.runs, options.workers, options.scheduler, options.folder)
