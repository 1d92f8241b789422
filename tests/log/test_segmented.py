import errno
import os
import threading
import time

import numpy as np
import pytest

from ema.core.errors import LogError
from ema.core.status import LogState
from ema.log import LogReader, LogSettings, LogWriter, schemas
from ema.log.segmented import SegmentedLog

T0 = 1_700_000_000_000_000_000


def _open(directory, free=lambda directory: 10**12, **settings):
    return SegmentedLog(directory, {"a.dbc": b"x"}, LogSettings(**settings), T0, 0.0, free_space=free)


def _cycles(directory):
    with LogReader(directory) as log:
        assert log.damage == []
        return [m.content["cycle"] for m in log.messages(lambda topic: topic.startswith("/estimate"))]


def _write(log, make, cycles, clock):
    for cycle in cycles:
        log.write(schemas.ESTIMATE.encode(make.estimate(cycle)))
    log.tick(T0 + int(clock * 1e9), clock)


def test_segments_are_cut_by_time_and_read_as_one(tmp_path, make):
    log = _open(tmp_path, segment_time=10)
    for second in range(35):
        _write(log, make, [second], float(second))
    log.close()
    assert len(list(tmp_path.glob("*.mcap"))) == 4
    assert _cycles(tmp_path) == list(range(35))


def test_segments_are_cut_by_size(tmp_path, make):
    log = _open(tmp_path, segment_size=0.05)
    for second in range(10):
        log.frames(make.frames(500, seed=second), "vcan0")
        log.tick(T0, float(second))
    log.close()
    sizes = [path.stat().st_size for path in tmp_path.glob("*.mcap")]
    assert len(sizes) > 3
    assert max(sizes) < 150_000


def test_every_segment_explains_itself(tmp_path, make):
    log = _open(tmp_path, segment_time=1)
    for second in range(3):
        _write(log, make, [second], float(second))
    log.close()
    for path in tmp_path.glob("*.mcap"):
        with LogReader(path) as one:
            assert one.attachments() == {"a.dbc": b"x"}


def test_the_oldest_segments_go_by_count_and_nothing_else(tmp_path, make):
    foreign = tmp_path / "flight.mcap"
    foreign.write_bytes(b"keep me")
    log = _open(tmp_path, segment_time=1, keep_segments=3)
    for second in range(10):
        _write(log, make, [second], float(second))
    log.close()
    foreign.read_bytes()
    foreign.unlink()
    assert _cycles(tmp_path) == [7, 8, 9]


def test_the_oldest_segments_go_when_space_is_short(tmp_path, make):
    def free(directory):
        return 200_000_000 - 50_000_000 * len(list(directory.glob("*.mcap")))

    log = _open(tmp_path, free, segment_time=1, keep_free=100)
    for second in range(10):
        _write(log, make, [second], float(second))
    log.close()
    assert log.state is LogState.OK
    assert _cycles(tmp_path)[-1] == 9
    assert len(list(tmp_path.glob("*.mcap"))) <= 3


def test_a_full_disk_stops_the_log_and_room_resumes_it(tmp_path, make):
    room = [10**12]
    log = _open(tmp_path, lambda directory: room[0])
    _write(log, make, [0], 0.0)
    log.write(schemas.ESTIMATE.encode(make.estimate(1)))
    room[0] = 0
    _write(log, make, [2], 1.0)  # cycles 1 and 2 are accepted, their flush fails
    assert log.state is LogState.FULL
    _write(log, make, [3, 4], 2.0)
    frames = make.frames(100)
    log.frames(frames, "vcan0")
    assert log.dropped == 0
    room[0] = 10**12
    _write(log, make, [], 3.0)
    assert log.state is LogState.OK
    _write(log, make, [5], 4.0)
    log.close()
    assert _cycles(tmp_path) == [0, 1, 2, 3, 4, 5]
    with LogReader(tmp_path) as back:
        (event,) = back.messages(lambda topic: topic == "/event")
        assert np.array_equal(np.concatenate([b.frames for b in back.frames()]), frames)
    assert event.content["text"] == "log was full for 2.0 s, 0 frames and messages dropped"


def test_a_disk_full_for_long_costs_what_exceeds_the_backlog_and_it_is_counted(tmp_path, make):
    room = [10**12]
    log = _open(tmp_path, lambda directory: room[0], segment_size=1000)
    _write(log, make, [0], 0.0)
    room[0] = 0
    batch, n_batches = make.frames(10_000), 200
    for n in range(n_batches):
        log.frames(batch, "vcan0")
        log.tick(T0, 1.0 + n)
    assert 0 < log.dropped < n_batches * len(batch)
    dropped = log.dropped
    room[0] = 10**12
    _write(log, make, [], 1000.0)
    log.close()
    with LogReader(tmp_path) as back:
        assert sum(len(b.frames) for b in back.frames()) == n_batches * len(batch) - dropped
        (event,) = back.messages(lambda topic: topic == "/event")
    assert f", {dropped} frames and messages dropped" in event.content["text"]


def test_a_write_cut_short_by_a_full_disk_is_completed_later(tmp_path, make, monkeypatch):
    """The device takes part of a chunk, then nothing, then all: the file has no hole and no double."""
    log = _open(tmp_path)
    budget = [10**9]
    write = os.write

    def limited(descriptor, data):
        count = min(len(data), budget[0])
        if count == 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        budget[0] -= count
        return write(descriptor, bytes(data[:count]))

    monkeypatch.setattr("ema.log.segment.os.write", limited)
    for n in range(5):
        log.frames(make.frames(500, seed=n), "vcan0")
        budget[0] = 1000 + 777 * n
        log.tick(T0, 3.0 * n + 1)
        assert log.state is LogState.FULL
        log.tick(T0, 3.0 * n + 2)
        budget[0] = 10**9
        log.tick(T0, 3.0 * n + 3)
        assert log.state is LogState.OK
    log.close()
    with LogReader(tmp_path) as back:
        frames = np.concatenate([b.frames for b in back.frames()])
        assert (back.damage, back.unfinished) == ([], [])
    assert np.array_equal(frames, np.concatenate([make.frames(500, seed=n) for n in range(5)]))


def test_a_device_that_fails_is_reported_and_a_new_segment_follows(tmp_path, make, monkeypatch):
    log = _open(tmp_path)
    _write(log, make, [0], 1.0)
    with monkeypatch.context() as patch:

        def broken(*_):
            raise OSError(errno.EIO, "Input/output error")

        patch.setattr("ema.log.segment.os.fdatasync", broken)
        _write(log, make, [1], 2.0)
        assert log.state is LogState.FAILED
    _write(log, make, [], 3.0)
    _write(log, make, [2], 4.0)
    assert log.state is LogState.OK
    log.close()
    with LogReader(tmp_path) as back:
        cycles = [m.content["cycle"] for m in back.messages(lambda topic: topic.startswith("/estimate"))]
    assert cycles == [0, 1, 2]
    assert len(list(tmp_path.glob("*.mcap"))) == 2


def test_a_directory_deleted_and_made_again_gets_a_new_segment(tmp_path, make):
    directory = tmp_path / "log"
    directory.mkdir()
    log = _open(directory)
    _write(log, make, [0], 1.0)
    next(directory.iterdir()).unlink()
    directory.rmdir()
    _write(log, make, [1], 2.0)
    assert log.state is LogState.FAILED
    directory.mkdir()
    _write(log, make, [], 3.0)
    _write(log, make, [2], 4.0)
    log.close()
    assert _cycles(directory) == [2]


def test_a_disk_that_is_full_at_the_start_does_not_stop_the_daemon(tmp_path, make, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("ema.log.segment.os.write", full)
        log = _open(tmp_path)
        assert log.state is LogState.FULL
        assert list(tmp_path.iterdir()) == []
    _write(log, make, [], 1.0)
    _write(log, make, [1], 2.0)
    log.close()
    assert _cycles(tmp_path) == [1]


@pytest.mark.parametrize("case", ["missing", "file", "read-only"])
def test_an_unusable_directory_is_refused_at_the_start(tmp_path, case, monkeypatch):
    directory = tmp_path / "log"
    if case == "file":
        directory.write_text("")
    elif case == "read-only":  # (root may write anywhere, so the refusal of the kernel is played)
        directory.mkdir()

        def refuse(*_):
            raise OSError(errno.EROFS, "Read-only file system")

        monkeypatch.setattr("ema.log.segment.os.open", refuse)
    with pytest.raises(LogError, match=f"log directory {directory} ") as refusal:
        LogWriter(directory)
    assert "\n" not in str(refusal.value)


def test_an_attachment_that_cannot_be_read_is_refused(tmp_path):
    with pytest.raises(LogError, match=r"attachment ema\.dbc"):
        LogWriter(tmp_path, {"ema.dbc": tmp_path / "absent.dbc"})


def test_data_is_on_the_disk_within_the_flush_interval_and_not_only_at_the_end(tmp_path, make):
    log = _open(tmp_path, flush_interval=1)
    _write(log, make, [0], 0.0)
    log.frames(make.frames(10), "vcan0")
    log.tick(T0, 0.6)
    with LogReader(tmp_path) as back:
        assert sum(len(b.frames) for b in back.frames()) == 10
        assert len(back.unfinished) == 1


def test_two_writers_never_share_a_folder(tmp_path, make):
    log = _open(tmp_path)
    with pytest.raises(LogError, match=rf"{tmp_path} cannot be written \(another monitor is writing there"):
        _open(tmp_path)
    log.close()
    second = _open(tmp_path)
    second.close()


def test_a_reader_knows_a_log_that_is_being_written_from_one_that_was_cut_off(tmp_path, make):
    log = _open(tmp_path)
    _write(log, make, [0], 1.0)
    with LogReader(tmp_path) as back:
        assert back.complaints() == []
        assert back.remarks() == [f"{log.path}: is still being written"]
    log._lock.release()  # as the kernel does where a process ends
    with LogReader(tmp_path) as back:
        assert back.complaints() == [f"{log.path}: was not finished: what came last may be missing"]


@pytest.mark.parametrize("years", [-20, 20])
def test_a_clock_that_jumps_by_years_never_deletes_the_newest(tmp_path, make, years):
    """Segments go by their running number, over several runs of the daemon as well."""
    settings = {"segment_time": 1, "keep_segments": 3}
    jump = int(years * 365.25 * 86400e9)
    cycle = 0
    for run in range(3):
        log = SegmentedLog(tmp_path, {}, LogSettings(keep_free=0, **settings), T0 + jump * (run % 2), 0.0)
        for second in range(4):
            log.write(schemas.ESTIMATE.encode(make.estimate(cycle)))
            log.tick(T0 + jump * ((run + second) % 2), float(second + 1))
            cycle += 1
        log.close()
        with LogReader(tmp_path) as back:
            kept = sorted(m.content["cycle"] for m in back.messages())
        assert kept == list(range(cycle - len(kept), cycle))
        assert len(kept) >= 2


def test_a_disk_filled_by_others_does_not_eat_the_log(tmp_path, make):
    room = [10**12]
    log = _open(tmp_path, lambda directory: room[0], segment_time=1, keep_least=4)
    for second in range(6):
        _write(log, make, [second], float(second))
    room[0] = 0
    for second in range(6, 12):
        _write(log, make, [second], float(second))
    assert log.state is LogState.FULL
    assert len(list(tmp_path.glob("*.mcap"))) == 4


def test_a_segment_that_was_taken_away_is_missed(tmp_path, make):
    for run in range(2):
        log = _open(tmp_path, segment_time=1, keep_segments=5)
        for second in range(3):
            _write(log, make, [3 * run + second], float(second))
        log.close()
    with LogReader(tmp_path) as back:  # the oldest have gone, as they may
        assert back.remarks() == []
    second, third = sorted(tmp_path.glob("*.mcap"), key=lambda path: path.stem[-4:])[1:3]
    second.unlink()
    with LogReader(tmp_path) as back:
        assert back.remarks() == [f"{third}: follows {second.name}, which is not among the files read"]


def test_a_device_that_hangs_is_seen(tmp_path, make, monkeypatch):
    gate, entered = threading.Event(), threading.Event()

    def stuck(self, t_ns, clock):
        entered.set()
        gate.wait(30)

    monkeypatch.setattr("ema.log.writer._PATIENCE", 0.05)
    monkeypatch.setattr("ema.log.segmented.SegmentedLog.tick", stuck)
    with LogWriter(tmp_path) as log:
        assert entered.wait(30)
        time.sleep(0.1)
        assert log.hangs
        gate.set()
        deadline = time.monotonic() + 30
        while log.hangs and time.monotonic() < deadline:
            time.sleep(0.01)
        assert not log.hangs
