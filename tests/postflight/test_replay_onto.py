"""Logs back onto a bus: times, filters, names, gaps, loops."""

import json
import threading

import can
import numpy as np
import pytest
from click.testing import CliRunner
from ema_postflight.onto import Replayer
from ema_postflight.pacing import Pace, merged
from ema_postflight.replay import replay
from ema_postflight.selection import IdFilter, Selection

from ema.bus.port import Port
from ema.core import frames as raw
from ema.core.errors import LogError
from ema.log.reader import FrameBatch, LogReader

S = 1_000_000_000


def _frames(times, ids=0):
    batch = raw.empty(len(times))
    batch["t_ns"] = (np.asarray(times) * 1e9 + 1e18).astype(np.int64)
    batch["id"] = ids
    return batch


class _Clock(threading.Event):
    """A clock that jumps to the end of each wait, and is an event that is never set."""

    now = 100.0

    def __call__(self):
        return self.now

    def wait(self, timeout=None):
        self.now += timeout
        return False


class _FakePort(Port):
    def __init__(self, clock, capacity=10**9):
        super().__init__("fake")
        self.clock, self.capacity, self.sent = clock, capacity, []

    def read(self, timeout):
        return raw.empty(0)

    def write(self, frames):
        taken = frames[: self.capacity]
        self.sent += [(self.clock.now - 100.0, int(i)) for i in taken["id"]]
        return len(taken)

    def close(self):
        pass


def _replay(batches, pace=None, ports=None, rounds=1):
    clock = _Clock()
    ports = {name: _FakePort(clock) for name in (ports or [""])}
    replayer = Replayer(ports, pace or Pace(), clock, clock)
    for _ in range(rounds):
        done = replayer.run(batches)
    return ports, done


def test_frames_keep_their_times():
    rng = np.random.default_rng(1)
    times = np.sort(rng.uniform(0, 20, 500))
    ports, done = _replay([FrameBatch("a", _frames(times, np.arange(500)))])
    sent = np.array(ports[""].sent)
    assert np.abs(sent[:, 0] - (times - times[0])).max() <= 2.1e-4  # frames due together go together
    assert np.array_equal(sent[:, 1], np.arange(500))
    assert done.n_sent == 500


def test_speed_gaps_and_clock_steps():
    times = [0, 1, 2, 100, 101, 50, 51]  # a long silence, then a clock set back
    ports, _ = _replay([FrameBatch("a", _frames(times))], Pace(speed=2, longest_gap=5))
    assert [t for t, _ in ports[""].sent] == pytest.approx([0, 0.5, 1, 3.5, 4, 4, 4.5])


def test_a_loop_goes_on_where_it_ended():
    ports, _ = _replay([FrameBatch("a", _frames([0, 1, 2]))], rounds=3)
    assert [t for t, _ in ports[""].sent] == pytest.approx([0, 1, 2, 2, 3, 4, 4, 5, 6])


def test_several_buses_are_merged_in_time_and_sent_each_on_its_own():
    rng = np.random.default_rng(2)
    batches = []
    for second in range(20):
        for bus in "ab":
            t = second * 0.2 + np.sort(rng.uniform(0, 0.2, 50))
            batches.append(FrameBatch(bus, _frames(t, ord(bus))))
    t = np.concatenate([traffic.frames["t_ns"] for traffic in merged(batches)])
    assert len(t) == 2000
    assert (np.diff(t.astype(np.int64)) >= 0).all()
    ports, done = _replay(batches, ports=["a", "b"])
    assert {i for _, i in ports["a"].sent} == {ord("a")}
    assert {i for _, i in ports["b"].sent} == {ord("b")}
    assert done.latest <= 1e-9
    _, done = _replay(batches, ports=["a"])
    assert (done.n_sent, done.n_unmapped) == (1000, 1000)


def test_one_bus_stays_in_the_order_received():
    t = [0, 2, 1, 1, 3, 0.5]  # not in order, as after a clock was set
    batches = [FrameBatch("a", _frames(t[:3], [0, 1, 2])), FrameBatch("a", _frames(t[3:], [3, 4, 5]))]
    assert [i for traffic in merged(batches) for i in traffic.frames["id"]] == [0, 1, 2, 3, 4, 5]


def test_only_frames_that_are_sent_can_be_late():
    """One bus that is not wanted, one that takes the first frame only, and a clock that is a second behind."""
    clock = _Clock()
    replayer = Replayer({"a": _FakePort(clock, capacity=1)}, Pace(), clock, clock)
    replayer.run([FrameBatch("b", _frames([0])), FrameBatch("a", _frames([0, 0, 0]))])
    clock.now += 1.0
    done = replayer.run([FrameBatch("a", _frames([0, 0])), FrameBatch("b", _frames([0]))])
    assert (done.n_sent, done.n_refused, done.n_unmapped) == (2, 3, 2)
    assert done.late.sum() == 2
    assert done.late_share(0.001) == 0.5
    assert done.latest == pytest.approx(1.0)


def test_what_the_bus_refuses_is_counted():
    clock = _Clock()
    replayer = Replayer({"": _FakePort(clock, capacity=1)}, Pace(), clock, clock)
    done = replayer.run([FrameBatch("a", _frames([0, 0, 0, 1]))])
    assert (done.n_sent, done.n_refused) == (2, 2)


@pytest.mark.parametrize(
    ("text", "passes", "stops"),
    [
        ("18A", [0x18A], [0x18B, 0x118A]),
        ("100-1FF", [0x100, 0x1FF], [0xFF, 0x200]),
        ("8B230000:1FFF0000", [0x0B230000, 0x0B23FFFF], [0x0B240000]),
        ("~18A", [0x18B], [0x18A]),
    ],
)
def test_filters(text, passes, stops):
    f = IdFilter.parse(text)
    assert f.matches(np.array(passes, np.uint32)).all()
    assert not f.matches(np.array(stops, np.uint32)).any()


def test_filters_are_joined_as_candump_does():
    batch = FrameBatch("a", _frames(np.arange(6), [1, 2, 3, 4, 5, 6]))
    other = FrameBatch("b", _frames([0], 1))
    selection = Selection(tuple(map(IdFilter.parse, ["1", "2-4", "~3"])), ("a",), {1: 2, 2: 1})
    (chosen,) = selection.apply([batch, other])
    assert chosen.frames["id"].tolist() == [2, 1, 4]
    assert batch.frames["id"].tolist() == [1, 2, 3, 4, 5, 6]


@pytest.mark.parametrize("text", ["", "xyz", "1-", "1:2:3", "123456789"])
def test_a_filter_that_is_none_is_refused(text):
    with pytest.raises(LogError, match="filter"):
        IdFilter.parse(text)


def test_error_frames_are_not_sent():
    batch = _frames([0, 1])
    batch["flags"][0] = raw.FrameFlag.ERROR
    (chosen,) = Selection().apply([FrameBatch("a", batch)])
    assert len(chosen.frames) == 1


def test_a_log_on_a_bus_is_what_was_logged(flight):
    with can.Bus(interface="virtual", channel="onto", protocol=can.CanProtocol.CAN_FD) as listener:
        answer = CliRunner().invoke(
            replay, [str(flight), "--onto", "virtual:onto", "--speed", "inf", "--json"], catch_exceptions=False
        )
        received = []
        while message := listener.recv(0):
            received.append((message.arbitration_id, bytes(message.data)))
    assert answer.exit_code == 0, answer.output
    told = json.loads(answer.stdout)
    assert told["sent"] == len(received) == 12 * 2 * 7
    assert told["latest"] is told["late_share_1ms"] is None  # without waiting no frame has a time
    with LogReader(flight) as log:
        frames = np.concatenate([b.frames for b in log.frames()])
    assert received == [(int(f["id"]), f["data"][: f["length"]].tobytes()) for f in frames]


def test_wrong_use_is_told_in_one_line(flight):
    def run(*arguments):
        return CliRunner().invoke(replay, [str(flight), *arguments])

    assert run().exit_code == 2
    assert "not ID=ID" in run("--onto", "virtual:x", "--rename", "1").output
    for rename in ("FFFFFFFFF=2", "2=FFFFFFFFF", "-1=2"):
        assert "at most 29 bits" in run("--onto", "virtual:x", "--rename", rename).output
    assert "renamed twice" in run("--onto", "virtual:x", "--rename", "1=2", "--rename", "1=3").output
    assert "given twice" in run("--onto", "virtual:x", "--onto", "virtual:y").output
    for option in (["--bundle", "b"], ["--cycles", "c.csv"], ["--out", "o.mcap"], ["--processes", "2"]):
        assert f"{option[0]} has a meaning with --identify only" in run("--onto", "virtual:x", *option).output
    for option in (["--speed", "1"], ["--loop", "2"], ["--skip-gaps", "1"], ["--id", "1"], ["--rename", "1=2"]):
        assert f"{option[0]} has a meaning with --onto only" in run("--identify", *option).output
    absent = run("--onto", "vcan9=virtual:x", "--speed", "inf")
    assert isinstance(absent.exception, LogError)
    assert "no frame of channel 'vcan9' in it (there is: 'vcan0')" in str(absent.exception)
    assert isinstance(run("--onto", "virtual:x", "--id", "7FF").exception, LogError)
    assert run("--onto", "virtual:x", "--speed", "0").exit_code == 2
