"""Unfinished and damaged files: everything sound is read, everything else is said."""

import numpy as np
import pytest

from ema.core.errors import LogError
from ema.log import LogReader, LogSettings, schemas
from ema.log.recovery import is_sound, recover
from ema.log.segmented import SegmentedLog

CHUNKS = 8


def _log(directory, make, finish=True):
    """A log of CHUNKS chunks, each with 20 frames and one estimate; returns its path and the size after each chunk."""
    log = SegmentedLog(directory, {"a.dbc": b"x"}, LogSettings(keep_free=0), 0, 0.0)
    sizes = []
    for n in range(CHUNKS):
        log.frames(make.frames(20, seed=n, start_ns=10**18 + n * 10**9), "vcan0")
        log.write(schemas.ESTIMATE.encode(make.estimate(n)))
        log.tick(0, n + 1.0)
        sizes.append(log.path.stat().st_size)
    path = log.path
    if finish:
        log.close()
    return path, sizes


def _read(path):
    with LogReader(path) as log:
        cycles = [m.content["cycle"] for m in log.messages(lambda topic: topic.startswith("/estimate"))]
        frames = np.concatenate([b.frames for b in log.frames()] or [np.zeros(0)])
        return cycles, frames, log.damage


def test_a_file_cut_anywhere_yields_every_whole_chunk(tmp_path, make):
    path, sizes = _log(tmp_path, make)
    data = path.read_bytes()
    cut = tmp_path / "cut.mcap"
    for size in np.linspace(8, len(data) - 1, 97).astype(int):
        cut.write_bytes(data[:size])
        cycles, frames, _ = _read(cut)
        whole = sum(int(size) >= s for s in sizes)
        assert cycles[:whole] == list(range(whole))
        assert len(cycles) - whole in (0, 1)  # the last chunk may be whole before its index is
        assert len(frames) == 20 * len(cycles)


def test_a_damaged_chunk_costs_that_chunk_only(tmp_path, make):
    path, sizes = _log(tmp_path, make)
    data = bytearray(path.read_bytes())
    data[sizes[2] + 300] ^= 0xFF  # inside the compressed data of chunk 3
    path.write_bytes(data)
    cycles, frames, damage = _read(path)
    assert cycles == [0, 1, 2, 4, 5, 6, 7]
    assert len(frames) == 140
    assert [d.what for d in damage] == [
        "a chunk is damaged",
        "its data differ from their checksum",
        "1 message on /estimate/0/linear missing between 2023-11-14T22:13:23.000Z and 2023-11-14T22:13:23.000Z",
        "1 message on /can/frames missing between 2001-09-09T01:46:43.000Z and 2001-09-09T01:46:43.000Z",
    ]


def test_zeroed_blocks_cost_what_they_cover(tmp_path, make):
    """What a power cut leaves: pages that never reached the disk."""
    path, sizes = _log(tmp_path, make)
    data = bytearray(path.read_bytes())
    data[sizes[1] + 10 : sizes[4] - 10] = bytes(sizes[4] - sizes[1] - 20)
    path.write_bytes(data)
    cycles, _, damage = _read(path)
    assert cycles == [0, 1, 5, 6, 7]
    assert damage


def test_channels_lost_with_the_first_chunk_are_found_at_the_end(tmp_path, make):
    path, sizes = _log(tmp_path, make)
    data = bytearray(path.read_bytes())
    data[sizes[0] - 400 : sizes[0]] = bytes(400)
    path.write_bytes(data)
    assert _read(path)[0] == list(range(1, CHUNKS))


def test_a_wrong_length_does_not_hide_what_follows(tmp_path, make):
    path, sizes = _log(tmp_path, make)
    data = bytearray(path.read_bytes())
    data[sizes[2] + 1 : sizes[2] + 9] = (2**62).to_bytes(8, "little")
    path.write_bytes(data)
    cycles, _, damage = _read(path)
    assert cycles == list(range(CHUNKS))  # its content tells how long the chunk is
    assert damage


@pytest.mark.parametrize("content", [b"", b"hello", b"\x89MCAP0\r"], ids=["empty", "text", "half a magic"])
def test_what_is_no_log_is_refused_in_one_line(tmp_path, content):
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    with pytest.raises(LogError, match=r"x\.mcap: is not an MCAP file") as refusal:
        LogReader(path)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("content", [b"", b"hello"], ids=["empty", "text"])
def test_what_a_kill_left_empty_costs_nothing_else_in_its_folder(tmp_path, make, content):
    path, _ = _log(tmp_path, make)
    empty = path.with_name("ema-29991231T000000000Z-0002.mcap")
    empty.write_bytes(content)
    with LogReader(tmp_path) as log:
        estimates = log.messages(lambda topic: topic.startswith("/estimate"))
        assert [m.content["cycle"] for m in estimates] == list(range(CHUNKS))
        assert [line for line in log.complaints() if str(empty) in line and "is not an MCAP file" in line]
        assert log.paths == [path]
    if content:
        with pytest.raises(LogError, match="is not an MCAP file"):  # it was asked for by name
            LogReader(iter([path, empty]))
    else:  # a shell named all that are there
        with LogReader(iter([path, empty])) as log:
            assert log.paths == [path]
            assert any(str(empty) in line for line in log.complaints())
    path.unlink()
    with pytest.raises(LogError, match="is not an MCAP file"):  # nothing else is there
        LogReader(tmp_path)


def test_recovery_writes_a_finished_copy_beside_and_never_over(tmp_path, make):
    path, _ = _log(tmp_path, make, finish=False)
    before = path.read_bytes()
    target = tmp_path / "y.mcap"
    assert not is_sound(path)
    found = recover(path, target)
    assert path.read_bytes() == before
    assert found.messages == 2 * CHUNKS
    assert is_sound(target)
    cycles, frames, _ = _read(target)
    assert cycles == list(range(CHUNKS))
    assert frames.tobytes() == _read(path)[1].tobytes()
    with LogReader(target) as log:
        assert log.attachments() == {"a.dbc": b"x"}
        assert log.unfinished == []
    with pytest.raises(LogError, match="exists, and is not overwritten"):
        recover(path, target)
