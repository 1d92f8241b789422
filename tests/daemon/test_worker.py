from __future__ import annotations

import threading
import time
from types import SimpleNamespace

from ema_daemon.worker import Worker


def job(cycle):
    return SimpleNamespace(cycle=cycle)


def test_jobs_are_answered_in_their_order():
    worker = Worker(lambda j: -j.cycle, 10, "test")
    for cycle in range(5):
        assert worker.submit(job(cycle))
    assert [(j.cycle, answer) for j, answer in worker.close(time.monotonic() + 10)] == [(n, -n) for n in range(5)]
    assert worker.idle


def test_a_full_queue_refuses_instead_of_waiting():
    gate = threading.Event()
    worker = Worker(lambda j: gate.wait(10), 2, "test")
    accepted = [worker.submit(job(n)) for n in range(6)]
    assert accepted[:2] == [True, True]
    assert accepted[-1] is False
    gate.set()
    assert len(worker.close(time.monotonic() + 10)) == accepted.count(True)


def test_an_error_is_an_answer():
    def fail(j):
        raise ValueError("no")

    worker = Worker(fail, 2, "test")
    worker.submit(job(1))
    ((_, answer),) = worker.close(time.monotonic() + 10)
    assert isinstance(answer, ValueError)


def test_a_job_that_does_not_end_does_not_hold_up_the_end():
    gate = threading.Event()
    worker = Worker(lambda j: gate.wait(10), 1, "test")
    for cycle in range(3):
        worker.submit(job(cycle))
    assert worker.close(time.monotonic() + 0.05) == []
    assert not worker.idle
    gate.set()


def test_every_worker_has_the_same_time_to_end():
    """When the deadline has passed nobody waits, neither for a place in the queue nor for the end."""
    gate, done = threading.Event(), threading.Event()
    hanging = Worker(lambda j: gate.wait(), 1, "hanging")
    for cycle in range(3):
        hanging.submit(job(cycle))
    quick = Worker(lambda j: done.set() or j.cycle, 1, "quick")
    quick.submit(job(7))
    assert done.wait(10)
    deadline = time.monotonic() + 0.05
    assert hanging.close(deadline) == []
    waited: list[float] = []
    quick._thread.join = waited.append
    quick.close(deadline)
    assert waited == [0.0]
    gate.set()
