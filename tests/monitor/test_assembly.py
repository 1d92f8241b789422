"""Cycles from frames: every way a cycle can begin and end, and what may happen to its frames on the way."""

from __future__ import annotations

import numpy as np
import pytest

from ema.bus import codec as codecs
from ema.bus.protection import Sender
from ema.core import frames as fr
from ema.core.frames import FrameFlag
from ema.core.status import Reason, Status
from ema.monitor import Event, MonitorSettings
from ema.monitor.assembler import Assembler
from ema.monitor.cycles import AssembledCycle

SETTINGS = MonitorSettings()


@pytest.fixture
def assemble(shipped_plant):
    """Feeds frames to a new assembler in batches of a given size: cycles and events."""

    def run(frames, *actuators, batch=97, finish=True, settings=SETTINGS):
        assembler = Assembler(codecs.default(), dict.fromkeys(actuators or (0,), shipped_plant), settings)
        out = []
        for begin in range(0, frames.size, batch):
            out += assembler.feed(frames[begin : begin + batch])
        if finish:
            out += assembler.finish()
        return [x for x in out if isinstance(x, AssembledCycle)], [x for x in out if isinstance(x, Event)]

    return run


@pytest.fixture
def flight(fly, growing):
    return fly(**growing)


@pytest.fixture
def frames(flight):
    return np.concatenate([frames for _, frames in flight])


def test_cycles_are_what_the_actuator_sent(assemble, flight, frames):
    cycles, events = assemble(frames)
    assert not events
    assert len(cycles) == len(flight)
    for cycle, (sent, own) in zip(cycles, flight, strict=True):
        assert cycle.span.cycle == sent.number
        assert cycle.t_ns == own["t_ns"][bench_last(own)]
        assert not cycle.missing.any()
        assert cycle.reasons == Reason(0)
        assert np.abs(cycle.i - sent.response.i[0]).max() < 1e-3
        assert np.abs(cycle.motion["theta_u"] - sent.response.theta_u[0, ::10]).max() < 1e-5
        assert np.abs(cycle.motion["theta_cmd"] - sent.theta_cmd[::10]).max() < 1e-5


def bench_last(own):
    return np.flatnonzero(own["id"] == codecs.default().messages["CycleEnd"].frame_id)[-1]


@pytest.mark.parametrize("batch", [1, 13, 564, 10_000])
def test_the_size_of_batches_does_not_matter(assemble, fly, growing, batch):
    bad = {"drop": 0.01, "repeat": 0.01, "corrupt": 0.01, "reorder": 0.01}
    frames = np.concatenate([frames for _, frames in fly(**growing, disturbances=bad)])
    whole, some = assemble(frames), assemble(frames, batch=batch)
    assert whole[1] == some[1]
    for a, b in zip(whole[0], some[0], strict=True):
        assert (a.t_ns, a.span, a.tally, a.reasons) == (b.t_ns, b.span, b.tally, b.reasons)
        assert np.array_equal(a.i, b.i)
        assert np.array_equal(a.missing, b.missing)


def test_each_kind_of_damage_is_counted(assemble, bench, frames):
    currents = bench.places(frames, "PhaseCurrents")
    lost, repeated, damaged, late = currents[[10, 200, 300, 400]]
    order = np.arange(frames.size)
    order[[late, bench.places(frames, "PhaseCurrents")[401]]] = order[[currents[401], late]]
    frames = frames[order]
    frames["data"][damaged, 20] ^= 4
    frames = np.insert(frames, repeated + 1, frames[repeated])
    frames = np.delete(frames, lost)
    cycle = assemble(frames)[0][0]
    assert cycle.tally == (2, 1, 1, 1, 0)  # the damaged one is missing as well
    assert cycle.reasons == (
        Reason.LOST_FRAMES | Reason.REORDERED_FRAMES | Reason.REPEATED_FRAMES | Reason.CORRUPT_FRAMES
    )
    assert np.flatnonzero(cycle.missing).tolist() == [*range(100, 110), *range(3000, 3010)]


@pytest.mark.parametrize(
    ("marker", "timeout", "reasons"),
    [
        ("CycleStart", 0.3, [Reason.NO_START] * 6),
        ("CycleEnd", 0.3, [Reason.NO_END | Reason.TIMEOUT] * 6),
        ("CycleEnd", 0.9, [Reason.NO_END] * 6),  # the next CycleStart, and at last the end of the frames, closes it
    ],
)
def test_either_marker_is_enough(assemble, bench, frames, marker, timeout, reasons):
    intact = assemble(frames)[0]
    settings = MonitorSettings(timeout=timeout)
    cycles, events = assemble(np.delete(frames, bench.places(frames, marker)), settings=settings)
    assert not events
    assert [c.reasons for c in cycles] == reasons
    for cycle, whole in zip(cycles, intact, strict=True):
        assert np.array_equal(cycle.i, whole.i)
        assert not cycle.missing.any()


def test_a_cycle_without_both_markers_is_reported(assemble, bench, frames):
    gone = [bench.places(frames, marker)[2] for marker in ("CycleStart", "CycleEnd")]
    cycles, events = assemble(np.delete(frames, gone))
    assert [c.span.cycle for c in cycles] == [0, 1, 3, 4, 5]
    assert [e.code for e in events] == ["cycles_missing"]
    assert "cycles 2…2" in events[0].text


def test_a_cycle_whose_frames_stop_is_closed_by_the_time_of_others(assemble, bench, frames):
    currents = bench.places(frames, "PhaseCurrents")
    end = bench.places(frames, "CycleEnd")[0]
    gone = [*currents[(currents > currents[250]) & (currents < end)], end]
    cycles, _ = assemble(np.delete(frames, gone))
    assert cycles[0].reasons == Reason.LOST_FRAMES | Reason.TIMEOUT | Reason.NO_END
    waited = cycles[0].t_ns - int(frames["t_ns"][currents[250]])
    assert SETTINGS.timeout * 1e9 < waited < SETTINGS.timeout * 1e9 + 0.11e9  # the next Supply frame
    assert cycles[0].missing.sum() == 5001 - 2510


def test_cycle_end_may_overtake_the_last_frames(assemble, bench, frames):
    end = bench.places(frames, "CycleEnd")[0]
    order = np.arange(frames.size)
    order[end - 5 : end + 1] = np.roll(order[end - 5 : end + 1], 1)
    cycles, _ = assemble(frames[order])
    assert cycles[0].reasons == Reason(0)
    assert not cycles[0].missing.any()


def test_frames_that_never_come_are_not_waited_for_longer_than_the_grace(assemble, bench, frames):
    last = bench.places(frames, "PhaseCurrents")[500]
    end = int(frames["t_ns"][bench.places(frames, "CycleEnd")[0]])
    cycles, _ = assemble(np.delete(frames, last))
    assert cycles[0].reasons == Reason.LOST_FRAMES
    assert SETTINGS.grace * 1e9 < cycles[0].t_ns - end < 0.11e9
    assert cycles[0].missing.sum() == 1


def test_frames_of_before_a_restart_are_not_taken_for_those_after_it(assemble, bench, frames):
    """The sender restarts in the middle of a cycle and uses the same sequence numbers again."""
    start = bench.places(frames, "CycleStart")
    cycle = frames[start[0] : start[1]]
    again = cycle.copy()
    again["t_ns"] += np.uint64(400_000_000)
    again = np.delete(again, bench.places(again, "PhaseCurrents")[[40, 41]])
    cycles, events = assemble(np.concatenate([cycle[:330], again]))
    assert [c.span.cycle for c in cycles] == [0]
    assert [e.code for e in events] == []
    missing = np.flatnonzero(cycles[0].missing) // 10
    assert {40, 41} <= set(missing.tolist())


def test_a_cycle_open_at_the_end_is_closed(assemble, bench, frames):
    half = frames[: bench.places(frames, "PhaseCurrents")[300]]
    cycles, _ = assemble(half)
    assert [c.reasons for c in cycles] == [Reason.NO_END | Reason.LOST_FRAMES]
    assert not assemble(half, finish=False)[0]


def test_several_actuators_share_a_bus(assemble, fly):
    flight = fly(n_cycles=2, actuators=[{"number": n} for n in (3, 7, 63)])
    cycles, events = assemble(np.concatenate([f for _, f in flight]), 3, 7, 63)
    assert not events
    assert sorted((c.span.cycle, c.actuator) for c in cycles) == [(n, a) for n in (0, 1) for a in (3, 7, 63)]
    for cycle in cycles:
        lane = (3, 7, 63).index(cycle.actuator)
        assert np.abs(cycle.i - flight[cycle.span.cycle][0].response.i[lane]).max() < 1e-3


def test_actuators_that_are_not_configured_are_foreign(assemble, fly):
    flight = fly(n_cycles=2, actuators=[{"number": n} for n in (3, 7, 63)])
    cycles, events = assemble(np.concatenate([f for _, f in flight]), 7)
    assert {c.actuator for c in cycles} == {7}
    assert not events


def test_another_motion_is_not_looked_at(assemble, bench, frames):
    sender, codec = Sender(), codecs.default()
    values = {"cycle": 9, "first_current": 0, "first_motion": 0, "n_samples": 777, "period": 1e-4, "motion_kind": 0}
    t_ns = int(frames["t_ns"][0]) - 10**9
    for name in ("CycleStart", "CycleEnd"):
        sender.skip(codec.messages[name].frame_id, 65535)  # the actuator's own frames go on from there
    odd = [sender.protect(codec.encode(name, 0, values, t_ns)) for name in ("CycleStart", "CycleEnd")]
    cycles, events = assemble(np.concatenate([*odd, frames]))
    assert [c.span.cycle for c in cycles] == list(range(6))
    assert [e.code for e in events] == ["other_motion", "cycles_missing"]
    assert "777 samples" in events[0].text


def test_own_frames_and_error_frames_change_nothing(assemble, frames):
    strange = frames.copy()
    strange["flags"] |= np.uint8(FrameFlag.TX)
    errors = frames[::5].copy()
    errors["flags"] |= np.uint8(FrameFlag.ERROR)
    errors["data"] = 0
    cycles, events = assemble(np.concatenate([strange[:100], errors, frames]))
    assert not events
    assert [c.reasons for c in cycles] == [Reason(0)] * 6


def test_what_the_kernel_dropped_is_noted_in_the_cycle(assemble, bench, frames):
    place = bench.places(frames, "PhaseCurrents")[600]
    notice = fr.overflow_notice(int(frames["t_ns"][place]))
    cycles, _ = assemble(np.concatenate([frames[:place], notice, frames[place + 1 :]]))
    assert [c.reasons for c in cycles][:3] == [Reason(0), Reason.KERNEL_DROPS | Reason.LOST_FRAMES, Reason(0)]
    assert fr.is_overflow(notice).all()
    assert not fr.is_overflow(frames).any()


def test_status_values_keep_their_order():
    """The worse of two statuses is the larger one: what joins them relies on it."""
    assert Status.VALID < Status.DEGRADED < Status.INVALID < Status.NOT_ESTIMATED


@pytest.mark.parametrize("gap", [0.001, 0.02, 0.2, 0.4], ids=lambda gap: f"after {gap:g} s")
@pytest.mark.parametrize("stop", [0.02, 0.3, 0.7, 1.3, 2.3, 4.7], ids=lambda stop: f"at {stop:g} s")
def test_an_actuator_restarted_at_any_moment_loses_no_cycle_beyond_the_one(flight, assemble, stop, gap):
    """It counts from the beginning again, so that its frames look like those of before."""
    frames = np.concatenate([frames for _, frames in flight])
    begin = int(frames["t_ns"][0])
    before = frames[frames["t_ns"] < begin + stop * 1e9]
    after = frames.copy()
    after["t_ns"] += np.uint64(int(before["t_ns"][-1]) - begin + int(gap * 1e9))
    cycles, _ = assemble(np.concatenate([before, after]))
    last, counted = cycles[-5:], Reason.CORRUPT_FRAMES | Reason.REPEATED_FRAMES  # the lost one's frames
    assert [cycle.span.cycle for cycle in last] == [1, 2, 3, 4, 5]
    assert not any(cycle.missing.any() or cycle.reasons & ~counted for cycle in last)
    assert not any(cycle.reasons for cycle in last[1:])


def numbered_from(fly, first, growing):
    """A flight whose cycles are numbered from `first` on, modulo 2³²."""
    from ema_simulator.traffic import Traffic

    traffic, batches = Traffic(codecs.default(), [0]), []
    for cycle, _ in fly(**growing):
        frames, due = traffic.frames(cycle._replace(number=first + cycle.number), 1.0)
        frames["t_ns"] = np.round(1e9 * (1_000 + cycle.t_start + due)).astype(np.int64)
        batches.append(frames)
    return np.concatenate(batches)


def test_after_two_to_the_thirty_two_cycles_they_are_numbered_from_zero_and_nothing_is_missed(fly, growing, assemble):
    cycles, events = assemble(numbered_from(fly, 2**32 - 3, growing))
    assert [c.span.cycle for c in cycles] == [2**32 - 3, 2**32 - 2, 2**32 - 1, 0, 1, 2]
    assert not any(c.missing.any() or c.reasons for c in cycles)
    assert events == []


def test_a_restart_at_the_last_number_loses_no_cycle(fly, growing, assemble):
    before = numbered_from(fly, 2**32 - 6, growing)
    after = numbered_from(fly, 0, growing)
    after["t_ns"] += 10 * 10**9
    cycles, events = assemble(np.concatenate([before, after]))
    assert [c.span.cycle for c in cycles] == [2**32 - 6 + n for n in range(6)] + list(range(6))
    assert not any(c.missing.any() for c in cycles)
    assert events == []  # the numbers go on as if nothing had happened
