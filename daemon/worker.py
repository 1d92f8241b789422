"""Slower identifiers beside the ingestion: a thread with a bounded queue.

LF2 takes a few milliseconds every few seconds; a thread costs nothing else, a process 60 MB. Identifiers that need more
run in a process of their own, and their thread only waits for the answer.
"""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable

from ema.identification import Estimate
from ema.monitor import Job

Answer = tuple[Job, Estimate | Exception]


class Worker:
    """Runs jobs one after the other, in their order.

    Parameters
    ----------
    run : callable
        From a job to its estimate; what it raises is the answer then.
    size : int
        Jobs that may wait.
    """

    def __init__(self, run: Callable[[Job], Estimate], size: int, name: str):
        self._run_job = run
        self._jobs: queue.Queue[Job | None] = queue.Queue(size)
        self._answers: queue.SimpleQueue[Answer] = queue.SimpleQueue()
        self._n_pending = 0
        self._thread = threading.Thread(target=self._run, name=f"ema-{name}", daemon=True)
        self._thread.start()

    def submit(self, job: Job) -> bool:
        """Queue a job; False when the queue is full: the job is not done."""
        try:
            self._jobs.put_nowait(job)
        except queue.Full:
            return False
        self._n_pending += 1
        return True

    def answers(self) -> list[Answer]:
        """What was answered since the last call."""
        found = []
        while not self._answers.empty():
            found.append(self._answers.get())
        self._n_pending -= len(found)
        return found

    @property
    def idle(self) -> bool:
        """Whether every job has been answered, and every answer taken."""
        return self._n_pending == 0

    def close(self, deadline: float) -> list[Answer]:
        """Finish the queued jobs if they are done by `deadline`, of `time.monotonic` [s]; their answers."""
        try:
            self._jobs.put(None, timeout=_until(deadline))
        except queue.Full:
            return self.answers()
        self._thread.join(_until(deadline))
        return self.answers()

    def _run(self) -> None:
        while (job := self._jobs.get()) is not None:
            try:
                self._answers.put((job, self._run_job(job)))
            except Exception as error:  # a defect in an identifier must not stop the monitor
                self._answers.put((job, error))


def _until(deadline: float) -> float:
    return max(0.0, deadline - time.monotonic())
