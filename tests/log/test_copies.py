"""The same flight given several times is read once, and said."""

import shutil

import pytest

from ema.log import LogReader, LogSettings, schemas
from ema.log.recovery import recover
from ema.log.segmented import SegmentedLog

T0 = 1_700_000_000_000_000_000
N = 40  # estimates of a flight


@pytest.fixture
def flown(make, tmp_path):
    """Writes a flight into a folder of its own; all of them are unlike, and begin at the same instant."""

    def fly(name, k=0.1):
        folder = tmp_path / name
        folder.mkdir()
        log = SegmentedLog(folder, {}, LogSettings(keep_free=0), T0, 0.0)
        for cycle in range(N):
            log.write(schemas.ESTIMATE.encode(make.estimate(cycle, k=k)))
            log.tick(T0 + cycle * 10**9, 1.0 + cycle)  # each a chunk of its own
        log.close()
        return next(folder.iterdir())

    return fly


def read(*paths):
    """Number of messages, and what is said."""
    with LogReader(paths) as log:
        n = sum(1 for _ in log.messages())
        return n, log.remarks(), log.complaints()


def test_ten_copies_count_once_and_each_is_said(flown, tmp_path):
    log = flown("a")
    copies = [tmp_path / f"copy-{n}.mcap" for n in range(10)]
    for copy in copies:
        shutil.copy(log, copy)
    n, remarks, complaints = read(log, *copies)
    assert (n, len(remarks), complaints) == (N, 10, [])
    assert all("is the same flight as" in remark and "not counted twice" in remark for remark in remarks)


def test_of_a_copy_cut_short_the_whole_one_is_read(flown, tmp_path):
    log = flown("a")
    cut = tmp_path / "0-cut.mcap"
    cut.write_bytes(log.read_bytes()[: log.stat().st_size // 2])
    n, (remark,), complaints = read(cut, log)
    assert (n, complaints) == (N, [])
    assert remark.startswith(str(cut))


def test_a_recovered_copy_beside_its_original_counts_once(flown, tmp_path):
    log = flown("a")
    data = bytearray(log.read_bytes())
    data[len(data) * 2 // 3] ^= 1
    log.write_bytes(data)
    recovered = recover(log, tmp_path / "a.recovered.mcap")
    n, remarks, _ = read(log, recovered.target)
    assert N - 10 < n <= N
    assert any("is the same flight as" in remark for remark in remarks)


def test_a_copy_whose_first_chunk_is_damaged_is_still_one(flown, tmp_path):
    log = flown("a")
    data = bytearray(log.read_bytes())
    data[data.index(b"\x04\x00\x00\x00zstd") + 40] ^= 1
    damaged = tmp_path / "damaged.mcap"
    damaged.write_bytes(data)
    n, remarks, _ = read(log, damaged)
    assert n == N
    assert len(remarks) == 1


def test_other_flights_are_not_taken_for_copies(flown):
    n, remarks, complaints = read(flown("a", 0.1), flown("b", 0.2))
    assert (n, remarks, complaints) == (2 * N, [], [])
