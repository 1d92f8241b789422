"""Promises and their deadlines, without a clock."""

from __future__ import annotations

import pytest

from ema.core.status import Lapse
from ema.monitor.supervision import LONGEST_STEP, Promise, Supervisor

SILENT, CYCLES, LOG = Promise(Lapse.SILENT, 3), Promise(Lapse.NO_CYCLES, 3), Promise(Lapse.LOG)


@pytest.fixture
def table():
    supervisor = Supervisor()
    supervisor.promise(SILENT, 1.0)
    supervisor.promise(CYCLES, 2.0, [SILENT])
    return supervisor


def run(table, until, *kept, step=0.25, start=0.0):
    """Looks every `step`; what is `kept` is seen each time. Changes as (time, lapse, lapsed)."""
    told = []
    n = round((until - start) / step)
    for i in range(n + 1):
        now = start + i * step
        table.advance(now)
        for promise in kept:
            table.keep(promise)
        told += [(now, change.promise.lapse, change.lapsed) for change in table.look()]
    return told


def test_what_is_seen_has_not_lapsed(table):
    assert run(table, 20.0, SILENT, CYCLES) == []
    assert not table.lapsed
    assert not table.awaited


def test_what_was_never_seen_is_awaited_until_its_deadline(table):
    assert run(table, 1.75, SILENT) == []
    assert table.awaited
    assert run(table, 2.5, SILENT, start=2.0) == [(2.25, Lapse.NO_CYCLES, True)]
    assert table.gravest == CYCLES


def test_a_lapse_is_told_once_and_its_end_with_how_long_it_lasted(table):
    run(table, 1.0, SILENT, CYCLES)
    assert run(table, 10.0, start=1.25) == [(2.25, Lapse.SILENT, True)]
    table.advance(10.25)
    table.keep(SILENT)
    (over,) = table.look()
    assert (over.promise, over.lapsed, over.lasted) == (SILENT, False, 8.0)


def test_the_cause_is_told_and_not_its_consequences(table):
    run(table, 1.0, SILENT, CYCLES)
    assert [lapse for _, lapse, _ in run(table, 30.0, start=1.25)] == [Lapse.SILENT]
    assert table.lapsed == {SILENT}


def test_what_a_cause_explains_from_now_on_is_not_over(table):
    assert run(table, 3.0, SILENT) == [(2.25, Lapse.NO_CYCLES, True)]
    assert run(table, 10.0, start=3.25) == [(4.25, Lapse.SILENT, True)]
    assert table.lapsed == {SILENT}


def test_what_rested_on_it_has_its_deadline_again_when_it_is_back(table):
    run(table, 10.0)
    assert run(table, 12.0, SILENT, start=10.25) == [(10.25, Lapse.SILENT, False)]
    assert run(table, 13.0, SILENT, start=12.25) == [(12.5, Lapse.NO_CYCLES, True)]


def test_what_this_process_has_slept_through_is_nobodys_silence(table):
    run(table, 1.0, SILENT, CYCLES)
    assert run(table, 3600.0, start=3600.0) == []  # nothing is seen yet: the frames still wait
    assert run(table, 3600.25, SILENT, CYCLES, start=3600.25) == []
    assert LONGEST_STEP <= 1.0


def test_what_is_known_to_fail_has_lapsed_until_it_is_seen(table):
    table.promise(LOG, float("inf"))
    run(table, 1.0, SILENT, CYCLES, LOG)
    table.fail(LOG)
    assert run(table, 1.5, SILENT, CYCLES, start=1.25) == [(1.25, Lapse.LOG, True)]
    assert table.ordered == [LOG]
    assert run(table, 1.75, SILENT, CYCLES, LOG, start=1.75) == [(1.75, Lapse.LOG, False)]
