"""Slower identifiers beside the ingestion: a thread with a few jobs that wait.

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
    """Runs jobs one after the other, in the order of their actuators.

    One job of an actuator waits at a time: a newer cycle takes the place of one that nobody has begun. So a worker that
    needs longer than jobs are apart still answers with the present, and is never later than by what it runs.

    Parameters
    ----------
    run : callable
        From a job to its estimate; what it raises is the answer then.
    size : int
        Actuators whose jobs may wait.
    """

    def __init__(self, run: Callable[[Job], Estimate], size: int, name: str):
        self._run_job, self._size = run, size
        self._waiting: dict[int, Job] = {}  # by actuator, the longest waiting first
        self._changed = threading.Condition()
        self._is_closing = False
        self._answers: queue.SimpleQueue[Answer] = queue.SimpleQueue()
        self._n_pending = 0
        self._thread = threading.Thread(target=self._run, name=f"ema-{name}", daemon=True)
        self._thread.start()

    def submit(self, job: Job) -> Job | None:
        """Have a job wait for its turn; the one not done for it: an older one, or itself where too many wait."""
        with self._changed:
            older = self._waiting.get(job.actuator)
            if older is None and len(self._waiting) >= self._size:
                return job
            self._waiting[job.actuator] = job
            self._changed.notify()
        self._n_pending += older is None
        return older

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
        """Finish the jobs that wait if they are done by `deadline`, of `time.monotonic` [s]; their answers."""
        with self._changed:
            self._is_closing = True
            self._changed.notify()
        self._thread.join(max(0.0, deadline - time.monotonic()))
        return self.answers()

    def _run(self) -> None:
        while (job := self._next()) is not None:
            try:
                self._answers.put((job, self._run_job(job)))
            except Exception as error:  # a defect in an identifier must not stop the monitor
                self._answers.put((job, error))

    def _next(self) -> Job | None:
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._is_closing)
            return self._waiting.pop(next(iter(self._waiting))) if self._waiting else None
