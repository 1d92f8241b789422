from __future__ import annotations

import threading
import time
from types import SimpleNamespace

from ema_daemon.worker import Worker


def job(cycle, actuator=0):
    return SimpleNamespace(cycle=cycle, actuator=actuator)


def cycles(answers):
    return [done.cycle for done, _ in answers]


def busy(gate, size=8):
    """A worker that has begun a job of actuator 9 and ends it when `gate` is set."""
    begun = threading.Event()
    worker = Worker(lambda j: begun.set() or gate.wait(10), size, "test")
    assert worker.submit(job(0, 9)) is None
    assert begun.wait(10)
    return worker


def test_actuators_are_answered_in_their_order():
    gate = threading.Event()
    worker = busy(gate)
    for actuator in (3, 1, 2):
        assert worker.submit(job(actuator, actuator)) is None
    gate.set()
    assert cycles(worker.close(time.monotonic() + 10)) == [0, 3, 1, 2]
    assert worker.idle


def test_a_newer_cycle_takes_the_place_of_one_that_waits():
    """A worker that was held up goes on with the present; what is not done for it is said."""
    gate = threading.Event()
    worker = busy(gate)
    left = [worker.submit(job(cycle)) for cycle in range(1, 5)]
    assert [one and one.cycle for one in left] == [None, 1, 2, 3]
    assert worker.submit(job(1, 1)) is None
    assert worker.submit(job(5)).cycle == 4
    gate.set()
    assert cycles(worker.close(time.monotonic() + 10)) == [0, 5, 1]
    assert worker.idle


def test_a_job_for_which_there_is_no_room_is_not_done():
    gate = threading.Event()
    worker = busy(gate, 2)
    left = [worker.submit(job(cycle, cycle)) for cycle in range(1, 5)]
    assert [one and one.cycle for one in left] == [None, None, 3, 4]
    gate.set()
    assert cycles(worker.close(time.monotonic() + 10)) == [0, 1, 2]


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
