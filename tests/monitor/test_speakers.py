"""A second sender in an actuator's name, without a key: nothing made of the mixture is ever valid, and it is said."""

import numpy as np
import pytest
from ema_simulator.traffic import Traffic

from ema.bus import codec as codecs
from ema.bus.header import sequence
from ema.bus.protection import Sender
from ema.core.status import Reason, Status
from ema.monitor import Event

CODEC = codecs.default()
PERIOD = 1.0
NOTHING, FAULTY = {"k1": 0.0}, {"k1": 0.2, "k4": 0.2}
RARE = ("CycleStart", "CycleEnd", "Supply")


@pytest.fixture(scope="module")
def send(fly):
    """Frames of an actuator from a number of cycles, whose sequences begin at given numbers; times in [s]."""
    made = {}

    def make(faults, n_cycles, begin, phases=None, period=PERIOD):
        key = repr((faults, n_cycles, period))
        if key not in made:
            made[key] = fly(n_cycles=n_cycles, seed=5, period=period, actuators=[{"faults": faults}])
        traffic, parts = Traffic(CODEC, [0]), []
        for name, phase in (phases or {}).items():
            traffic._sender.skip(CODEC.messages[name].frame_id, phase)
        for cycle, _ in made[key]:
            frames, due = traffic.frames(cycle, period)
            seconds = begin + cycle.number * period + due
            frames["t_ns"] = 1_700_000_000_000_000_000 + np.round(1e9 * seconds).astype(np.int64)
            parts.append(frames)
        return np.concatenate(parts)

    return make


def merged(*flights):
    frames = np.concatenate(flights)
    return frames[np.argsort(frames["t_ns"], kind="stable")]


def answers(bench, frames):
    outputs = bench.replay(frames, bench.monitor(slower={}))
    estimates = [o for o in outputs if hasattr(o, "estimate")]
    return estimates, [o.code for o in outputs if isinstance(o, Event) and "speaker" in o.code]


def assert_never_mixed(estimates, genuine):
    """What is not INVALID is to the last bit what the genuine sender alone gives, or the other one alone."""
    for o in estimates:
        if o.estimate.status < Status.INVALID:
            assert any(np.array_equal(o.estimate.k, k) for k in genuine), (o.cycle, o.estimate.k)


def alone(bench, *flights):
    return [o.estimate.k for flight in flights for o in answers(bench, flight)[0]]


PHASES = {
    "in step": 0, "one ahead": 1, "ten ahead": 10, "ten behind": -10, "hundred ahead": 100, "far": 20_000,
    "wrapped": -30_000,
}  # fmt: skip


@pytest.mark.parametrize("phase", PHASES.values(), ids=PHASES.keys())
@pytest.mark.parametrize("start", [2.013, 2.25, 2.4985, 2.6, 2.97, 3.0])
def test_a_second_speaker_makes_estimates_invalid_as_long_as_it_speaks(bench, send, start, phase):
    """It has the same rate and other faults, starts in a cycle or in a pause, and stops after three of its cycles."""
    first = send(NOTHING, 10, 0.0)
    numbers = {name: _number(first, name, start) for name in CODEC.messages if _number(first, name, start) is not None}
    second = send(FAULTY, 3, start, {name: (n + phase) % 65536 for name, n in numbers.items()})
    estimates, events = answers(bench, merged(first, second))
    assert_never_mixed(estimates, alone(bench, first, second))
    ends = {o.t_ns / 1e9 - 1_700_000_000: o.estimate for o in estimates}
    speaking = [e for t, e in ends.items() if start + 0.7 < t <= start + 3 * PERIOD]
    assert speaking
    assert all(e.status >= Status.INVALID and e.reasons & Reason.TWO_SPEAKERS for e in speaking)
    before, after = ([e for t, e in ends.items() if low < t < high] for low, high in ((0, 2), (start + 5.6, 99)))
    assert len(before) == 2
    assert len(after) >= 1
    assert all(e.status == Status.VALID for e in before + after)
    assert events == ["two_speakers", "one_speaker"]


def _number(frames, name, t):
    """The genuine sender's next sequence number of a message at a time."""
    own = frames[frames["id"] == CODEC.messages[name].frame_id]
    sent = own[own["t_ns"] < 1_700_000_000_000_000_000 + round(t * 1e9)]
    return (int(sequence(sent[-1:])[0]) + 1) % 65536 if sent.size else None


def test_at_any_moment_with_any_phase(bench, send):
    """Random starts and independent phases of every message, some of it at another rate."""
    rng = np.random.default_rng(7)
    first = send(NOTHING, 8, 0.0)
    for _ in range(12):
        start = rng.uniform(1, 4)
        phases = {name: int(rng.integers(65536)) for name in (*RARE, "PhaseCurrents", "Motion")}
        second = send(FAULTY, 3, start, phases)
        if rng.random() < 0.5:  # half as fast, or twice
            begin = second["t_ns"][0]
            factor = rng.choice([0.5, 2.0])
            second["t_ns"] = begin + ((second["t_ns"] - begin) * factor).astype(np.uint64)
        estimates, events = answers(bench, merged(first, second))
        stop = (int(second["t_ns"][-1]) - 1_700_000_000_000_000_000) / 1e9
        speaking = [o for o in estimates if start + 1.2 < o.t_ns / 1e9 - 1_700_000_000 <= stop]
        assert_never_mixed(estimates, alone(bench, first, second))
        assert all(o.estimate.status >= Status.INVALID for o in speaking), (start, phases)
        assert events[:1] == ["two_speakers"], (start, phases)


@pytest.mark.parametrize("sends_supply", [True, False])
def test_one_whose_cycles_lie_in_the_pauses_and_that_looks_like_a_restart(bench, send, sends_supply):
    """It counts from 0, as after a restart; but the genuine one's supply voltage goes on meanwhile."""
    first = send(NOTHING, 4, 0.0, dict.fromkeys((*RARE, "PhaseCurrents", "Motion"), 1000), period=2.0)
    second = send(FAULTY, 2, 2.7, period=2.0)
    second = second[(second["id"] != CODEC.messages["Supply"].frame_id) | sends_supply]
    estimates, events = answers(bench, merged(first, second))
    ends = {round(o.t_ns / 1e9 - 1_700_000_000, 1): o.estimate for o in estimates}
    assert [t for t in ends if t < 7] == pytest.approx([0.5, 2.5, 3.2, 4.5, 5.2, 6.5])
    assert [e.status >= Status.INVALID for t, e in ends.items() if t < 6] == [False, False, True, True, True]
    assert events[0] == "two_speakers"


def test_one_that_sends_each_frame_just_before_the_genuine_one(bench, send):
    """It continues the sequence, so that every frame of its own is the next one."""
    first = send(NOTHING, 4, 0.0)
    ahead = send(FAULTY, 4, 0.0)
    ahead["t_ns"] -= np.uint64(200_000)
    estimates, events = answers(bench, merged(first, ahead))
    assert len(estimates) == 4
    assert all(o.estimate.status >= Status.INVALID for o in estimates)
    assert events == ["two_speakers"]


def test_one_that_changes_the_currents_of_a_few_frames_only(bench, send):
    first = send(NOTHING, 4, 0.0)
    other = send(FAULTY, 4, 0.0)
    currents = np.flatnonzero(other["id"] == CODEC.messages["PhaseCurrents"].frame_id)
    few = other[currents[700:900:20]]  # of the second cycle, 20 ms apart
    few["t_ns"] -= np.uint64(200_000)
    estimates, _ = answers(bench, merged(first, few))
    assert estimates[1].estimate.status == Status.INVALID
    assert estimates[1].estimate.reasons & Reason.TWO_SPEAKERS


def test_one_that_changes_positions_only(bench, send):
    """The first of Motion decides the start state."""
    first, other = send(NOTHING, 4, 0.0), send(FAULTY, 4, 0.0)
    motions = other[other["id"] == CODEC.messages["Motion"].frame_id]
    few = motions[51:60:3]  # of the second cycle
    few["data"][:, 4:] ^= 1
    e2e = Sender()
    for n, frame in enumerate(few):
        e2e.skip(int(frame["id"]), (int(sequence(few[n : n + 1])[0]) - e2e.next_sequence(int(frame["id"]))) % 65536)
        few[n : n + 1] = e2e.protect(few[n : n + 1].copy())
    few["t_ns"] -= np.uint64(200_000)
    estimates, _ = answers(bench, merged(first, few))
    assert estimates[1].estimate.status == Status.INVALID
    assert estimates[1].estimate.reasons & Reason.TWO_SPEAKERS


def test_the_same_in_batches_of_any_size(bench, send):
    first = send(NOTHING, 4, 0.0)
    frames = merged(first, send(FAULTY, 2, 0.7, {"PhaseCurrents": 530, "Motion": 40}))
    told = []
    for batch in (1, 7, 100, 5000):
        outputs = bench.replay(frames, bench.monitor(slower={}), batch)
        told.append([(o.cycle, o.estimate.status, o.estimate.reasons) for o in outputs if hasattr(o, "estimate")])
    assert told[0] == told[1] == told[2] == told[3]


@pytest.mark.parametrize(
    "disturbances",
    [
        {"repeat": 0.05},
        {"reorder": 0.05},
        {"drop": 0.05},
        {"corrupt": 0.05},
        {"repeat": 0.02, "reorder": 0.02, "drop": 0.02},
    ],
    ids=lambda d: " ".join(d),
)
def test_a_bad_bus_is_no_second_speaker(bench, fly, disturbances):
    flight = fly(n_cycles=5, seed=3, disturbances=disturbances, actuators=[{"faults": NOTHING}])
    outputs = bench.outputs(flight, slower={})
    assert not [o for o in outputs if isinstance(o, Event) and "speaker" in o.code]
    assert not any(o.estimate.reasons & Reason.TWO_SPEAKERS for o in outputs if hasattr(o, "estimate"))


@pytest.mark.parametrize("length", [0.08, 0.15, 0.4, 1.2])
def test_a_gap_is_no_second_speaker(bench, send, length):
    frames = send(NOTHING, 6, 0.0)
    t = (frames["t_ns"] - np.uint64(1_700_000_000_000_000_000)) / 1e9
    frames = frames[(t < 1.1) | (t > 1.1 + length)]
    estimates, events = answers(bench, frames)
    assert not events
    assert not any(o.estimate.reasons & Reason.TWO_SPEAKERS for o in estimates)
