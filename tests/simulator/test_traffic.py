"""What goes over the bus is the record, frame by frame."""

import numpy as np
import pytest
from ema_simulator.disturb import disturb
from ema_simulator.fleet import Fleet
from ema_simulator.scenario import Disturbances, load
from ema_simulator.traffic import Traffic

from ema.bus.header import sequence
from ema.bus.load import frame_time
from ema.bus.protection import Check, Receiver


@pytest.fixture(scope="module")
def cycles(tmp_path_factory):
    path = tmp_path_factory.mktemp("x") / "scenario.yaml"
    path.write_text("actuators: [{number: 5}, {number: 63}]\nseed: 7\n")
    scenario, plant = load(path)
    fleet = Fleet(scenario, plant)
    k = np.zeros((2, 6))
    return [fleet.next_cycle(k), fleet.next_cycle(k)]


@pytest.fixture
def sent(codec, cycles):
    traffic = Traffic(codec, [5, 63])
    return [traffic.frames(cycle, 1.0) for cycle in cycles]


def by_name(codec, frames, actuator):
    own = frames[(frames["id"] >> 2 & 63) == actuator]
    return {message.name: (message.decode(part), part) for message, part in codec.split(own)}


def test_every_frame_passes_the_protection(codec, sent):
    checks = Receiver(codec).check(np.concatenate([frames for frames, _ in sent]))
    assert not checks.any()


def test_the_frames_of_a_cycle_hold_its_record(codec, cycles, sent):
    for cycle, (frames, _) in zip(cycles, sent, strict=True):
        for lane, number in enumerate((5, 63)):
            parts = by_name(codec, frames, number)
            counts = {name: part.size for name, (_, part) in parts.items()}
            assert counts == {"CycleStart": 1, "CycleEnd": 1, "PhaseCurrents": 501, "Motion": 51, "Supply": 10}
            currents, part = parts["PhaseCurrents"]
            start = parts["CycleStart"][0]
            assert start["cycle"][0] == cycle.number
            assert start["n_samples"][0] == 5001
            assert start["period"][0] == pytest.approx(1e-4)
            assert sequence(part)[0] == start["first_current"][0]
            for j, phase in enumerate("abc"):
                x = currents[f"i_{phase}"].ravel()
                assert np.array_equal(x[:5001], cycle.response.i[lane, j])  # the ADC's grid survives the bus
                assert not x[5001:].any()
            motion, part = parts["Motion"]
            assert sequence(part)[0] == start["first_motion"][0]
            turns = np.unwrap(motion["theta_m"].ravel()[:501])
            expected = cycle.response.theta_m[lane, ::10]
            assert np.abs(turns - turns[0] - (expected - expected[0])).max() < 2e-4
            assert np.abs(motion["theta_u"].ravel()[:501] - cycle.response.theta_u[lane, ::10]).max() < 1e-12
            assert np.abs(motion["theta_cmd"].ravel()[:501] - cycle.theta_cmd[::10]).max() <= 0.75001e-5


def test_start_and_end_say_the_same(codec, sent):
    parts = by_name(codec, sent[1][0], 5)
    assert parts["CycleStart"][0] == parts["CycleEnd"][0]


def test_frames_are_due_in_order_and_within_the_period(codec, sent):
    for frames, due in sent:
        assert (np.diff(due) >= 0).all()
        assert due[0] == 0.0
        assert due[-1] < 1.0
        starts = [f["id"] >> 8 & 0xFF for f in frames[due == 0.0]]
        assert starts.count(1) == 2


def test_a_quiet_bus_changes_nothing(sent):
    frames, due = sent[0]
    same, when = disturb(frames, due, 0, Disturbances(), np.random.default_rng(1))
    assert np.array_equal(same, frames)
    assert np.array_equal(when, due)


@pytest.mark.parametrize(
    ("disturbances", "check"),
    [
        ({"drop": 0.05}, Check.SOME_LOST),
        ({"repeat": 0.05}, Check.REPEATED),
        ({"corrupt": 0.05}, Check.CRC_ERROR),
        ({"reorder": 0.05}, Check.REORDERED),
    ],
)
def test_each_disturbance_is_seen_for_what_it_is(codec, sent, disturbances, check):
    frames, due = sent[0]
    out, when = disturb(frames, due, 0, Disturbances(**disturbances), np.random.default_rng(1))
    again, _ = disturb(frames, due, 0, Disturbances(**disturbances), np.random.default_rng(1))
    assert np.array_equal(out, again)
    assert (np.diff(when) >= 0).all()
    assert (Receiver(codec).check(out) == check).sum() > 15


def test_a_gap_is_in_its_cycle_only(sent):
    frames, due = sent[0]
    gap = Disturbances(gaps=[{"cycle": 0, "start": 0.2, "duration": "50 ms"}])
    out, when = disturb(frames, due, 0, gap, np.random.default_rng(1))
    assert not ((when >= 0.2) & (when < 0.25)).any()
    assert frames.size - out.size == pytest.approx(2 * 55, abs=3)
    assert disturb(frames, due, 1, gap, np.random.default_rng(1))[0].size == frames.size


@pytest.mark.parametrize(("stagger", "period", "at_once"), [(0.0, 1.0, 6), (0.25, 2.0, 2), (0.5, 3.25, 1)])
def test_staggered_actuators_share_a_bus_that_all_at_once_would_overfill(codec, write, stagger, period, at_once):
    """Six on a bus of 1 and 5 Mbit/s with as many stuff bits as there can be; docs/bus.md says so."""
    actuators = ", ".join(f"{{number: {n}}}" for n in range(6))
    scenario, plant = load(write(f"period: {period} s\nstagger: {stagger} s\nactuators: [{actuators}]"))
    frames, due = Traffic(codec, range(6), scenario.stagger).frames(
        Fleet(scenario, plant).next_cycle(np.zeros((6, 6))), scenario.period
    )
    assert due.max() < scenario.period
    busy = np.array([frame_time(int(n), 1e6, 5e6, worst=True) for n in frames["length"]])
    load_of_50_ms = np.bincount((due / 0.05).astype(int), weights=busy) / 0.05
    assert (load_of_50_ms.max() < 0.5) == (at_once <= 2)
    assert (load_of_50_ms.max() > 1.0) == (at_once == 6)
