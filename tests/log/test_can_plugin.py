"""python-can's own programs and every format it knows, with a real car's log."""

import lzma
import tracemalloc
from pathlib import Path

import can
import can.logconvert
import numpy as np
import pytest
from can.util import channel2int

from ema.core.errors import LogError
from ema.log import LogReader

CAR = Path(__file__).parents[1] / "data/can_motec/can_sample.log.xz"


@pytest.fixture(scope="module")
def car(tmp_path_factory):
    """The first 4 s of the car's log as candump wrote it."""
    path = tmp_path_factory.mktemp("car") / "car.log"
    with lzma.open(CAR, "rt") as whole:
        path.write_text("".join(next(whole) for _ in range(4000)))
    return path


def _convert(monkeypatch, source, target):
    monkeypatch.setattr("sys.argv", ["can_logconvert", str(source), str(target)])
    can.logconvert.main()


def _messages(path):
    with can.LogReader(path) as log:
        return list(log)


def _same(one, other, seconds):
    """Equal up to what a format cannot hold: a start time, and digits of the time stamp."""
    assert len(one) == len(other)
    t = np.array([[a.timestamp, b.timestamp] for a, b in zip(one, other, strict=True)])
    assert np.abs(np.diff(t - t[0], axis=1)).max() <= seconds
    for a, b in zip(one, other, strict=True):
        assert a.equals(b, timestamp_delta=None, check_channel=False)
        assert channel2int(a.channel) == channel2int(b.channel)


# resolution of a time stamp: candump and csv microseconds, asc 1 µs written and shifted by its start, trc 1 ns relative
@pytest.mark.parametrize(
    ("suffix", "seconds"), [("log", 1e-6), ("csv", 1e-6), ("asc", 2e-6), ("blf", 2e-6), ("trc", 1e-4)]
)
def test_round_trip_through(suffix, seconds, car, tmp_path, monkeypatch):
    """candump → mcap → the other format → mcap."""
    first, other, last = tmp_path / "first.mcap", tmp_path / f"other.{suffix}", tmp_path / "last.mcap"
    _convert(monkeypatch, car, first)
    _convert(monkeypatch, first, other)
    _convert(monkeypatch, other, last)
    original = _messages(car)
    _same(original, _messages(first), 0)
    for m in original:
        if suffix == "csv":
            m.channel, m.is_rx = None, True  # which it does not hold
        elif suffix == "trc":
            m.channel = "1"  # numbered from 1
    _same(original, _messages(last), seconds)


def test_a_log_converted_and_back_is_what_python_can_writes_itself(car, tmp_path, monkeypatch):
    _convert(monkeypatch, car, tmp_path / "a.mcap")
    _convert(monkeypatch, tmp_path / "a.mcap", tmp_path / "ours.log")
    _convert(monkeypatch, car, tmp_path / "theirs.log")
    assert (tmp_path / "ours.log").read_bytes() == (tmp_path / "theirs.log").read_bytes()


def test_every_kind_of_frame_survives(tmp_path):
    sent = [
        can.Message(timestamp=1.7e9, arbitration_id=0x7FF, is_extended_id=False, data=b"12345678", channel="can0"),
        can.Message(timestamp=1.7e9 + 1e-6, arbitration_id=2**29 - 1, is_fd=True, data=bytes(64), channel="can1"),
        can.Message(timestamp=1.7e9 + 2e-6, arbitration_id=1, is_fd=True, bitrate_switch=True, data=bytes(12)),
        can.Message(timestamp=1.7e9 + 3e-6, arbitration_id=2, is_remote_frame=True, dlc=8),
        can.Message(timestamp=1.7e9 + 4e-6, is_error_frame=True, arbitration_id=4, dlc=8, data=bytes(8)),
        can.Message(timestamp=1.7e9 + 5e-6, arbitration_id=3, is_rx=False, data=b""),
        can.Message(timestamp=1.7e9 + 6e-6, arbitration_id=4, is_fd=True, error_state_indicator=True, data=b"x"),
    ]
    with can.Logger(tmp_path / "x.mcap") as log:
        for m in sent:
            log(m)
        assert log.file_size() > 0
    received = sorted(_messages(tmp_path / "x.mcap"), key=lambda m: m.timestamp)
    for a, b in zip(sent, received, strict=True):
        assert a.equals(b, timestamp_delta=0), (a, b)


def test_a_log_is_never_overwritten(tmp_path):
    can.Logger(tmp_path / "x.mcap").stop()
    with pytest.raises(LogError, match="exists, and is not overwritten"):
        can.Logger(tmp_path / "x.mcap")
    with pytest.raises(LogError, match="cannot be appended to"):
        can.Logger(tmp_path / "x.mcap", append=True)
    with pytest.raises(LogError, match="cannot be written"):
        can.Logger(tmp_path / "absent/x.mcap")


def test_memory_does_not_grow_with_the_log(tmp_path):
    with lzma.open(CAR, "rt") as whole:
        (tmp_path / "car.log").write_text("".join(next(whole) for _ in range(20_000)))
    tracemalloc.start()
    try:
        with can.LogReader(tmp_path / "car.log") as source, can.Logger(tmp_path / "car.mcap") as target:
            for m in source:
                target(m)
        with LogReader(tmp_path / "car.mcap") as log:
            assert sum(len(b.frames) for b in log.frames()) == 20_000
        assert tracemalloc.get_traced_memory()[1] < 16e6
    finally:
        tracemalloc.stop()
