"""No log lies about itself: whatever single thing is wrong with a file is said, and nothing is silently missing.

A small log, finished and unfinished. What was flipped and how much was lost is printed (`pytest -s`).
"""

import io
import itertools

import numpy as np
import pytest
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from ema.core.errors import LogError
from ema.log import LogSettings, schemas
from ema.log.records import RECORD
from ema.log.scan import McapFile
from ema.log.segmented import SegmentedLog

CHUNKS = 5
SEED = 20261124
N_RANDOM = 2000


def _log(directory, make, finish):
    directory.mkdir()
    log = SegmentedLog(directory, {"a.dbc": b"x" * 40, "b.yaml": b"y: 1"}, LogSettings(keep_free=0), 0, 0.0)
    for n in range(CHUNKS):
        log.frames(make.frames(3, seed=n, start_ns=10**18 + n * 10**9), "vcan0")
        log.write(schemas.ESTIMATE.encode(make.estimate(n, t_ns=10**18 + n * 10**9)))
        if n % 2:
            log.write(schemas.EVENT.encode(make.event(10**18 + n * 10**9)))
        log.tick(0, n + 1.0)
    path = log.path
    if finish:
        log.close()
    return path.read_bytes()


@pytest.fixture(scope="module", params=["finished", "unfinished"])
def log(request, tmp_path_factory, make):
    """Bytes of a log and whether it is finished."""
    finished = request.param == "finished"
    return _log(tmp_path_factory.mktemp("integrity") / "log", make, finished), finished


class InMemory:
    """Stands for a path: thousands of files would take minutes."""

    def __init__(self, data):
        self._data = data

    def open(self, _):
        return io.BytesIO(self._data)


@pytest.fixture(autouse=True)
def in_memory(monkeypatch):
    monkeypatch.setattr("ema.log.scan.require_file", lambda path: path)


class Read:
    """What a reader finds in a file of these bytes."""

    def __init__(self, data, start_ns=None, end_ns=None):
        self.messages, self.said, self.missing, self.finished = [], [], [], False
        try:
            file = McapFile(InMemory(data), self.said.append)
        except LogError as error:
            self.said = [error]
            return
        self.messages = [tuple(m) for m in file.messages(lambda topic: True, start_ns, end_ns)]
        self.missing, self.finished = file.missing, file.finished
        self.attachments = [a.name for a in file.attachments()]
        file.close()


def _boundaries(data):
    """Offsets of all records of a sound file, those of the summary too, and the end."""
    at, found = len(MCAP0_MAGIC), []
    while at < len(data) and data[at : at + 8] != MCAP0_MAGIC:
        found.append(at)
        at += RECORD.size + RECORD.unpack_from(data, at)[1]
    return [*found, at]


def _chunks(data):
    """(begin, end) of each chunk with its message indexes."""
    bounds = _boundaries(data)
    begins = [at for at in bounds[:-1] if data[at] == Opcode.CHUNK]
    ends = [
        next(at for at in bounds if at > begin and (at >= len(data) or data[at] != Opcode.MESSAGE_INDEX))
        for begin in begins
    ]
    return list(zip(begins, ends, strict=True))


def _flipped(data, bits):
    for bit in bits:
        changed = bytearray(data)
        changed[bit // 8] ^= 1 << bit % 8
        yield bit, bytes(changed)


def _judge(whole, finished, changed_reads):
    """Never silently fewer; of a finished file every change is said. Returns number of changes and messages lost."""
    lost, n = 0, 0
    for what, read in changed_reads:
        n += 1
        gone = [m for m in whole.messages if m not in read.messages]
        lost += len(gone)
        assert read.said or not gone, f"{what}: {len(gone)} messages silently missing"
        noticed = read.said or read.finished != finished
        assert noticed or not finished, f"{what}: not said"
    return n, lost


def test_a_sound_log_has_nothing_said_of_it(log):
    data, finished = log
    read = Read(data)
    assert read.said == read.missing == []
    assert read.finished == finished
    assert len(read.messages) == 2 * CHUNKS + CHUNKS // 2


def test_every_bit_of_every_record_header(log):
    data, finished = log
    whole = Read(data)
    headers = [at for at in _boundaries(data) if at < len(data) - 8]
    bits = [8 * at + bit for at in headers for bit in range(8 * RECORD.size)]
    reads = ((bit, Read(changed)) for bit, changed in _flipped(data, bits))
    n, lost = _judge(whole, finished, reads)
    print(f"{n} bits of {len(headers)} record headers: {lost} messages lost, none silently")
    assert lost == 0  # the content tells what the record is


def test_random_bits_elsewhere(log):
    data, finished = log
    print(f"seed {SEED}")
    n = N_RANDOM if finished else N_RANDOM // 4
    bits = np.random.default_rng(SEED).integers(0, 8 * len(data), n).tolist()
    whole = Read(data)
    reads = ((bit, Read(changed)) for bit, changed in _flipped(data, bits))
    n, lost = _judge(whole, finished, reads)
    print(f"{n} random bits: {lost} messages of damaged chunks lost, none silently")


def test_times_of_chunks_do_not_hide_messages_from_a_time_range(log):
    """A flipped start time could put a chunk outside of what is asked for."""
    data, _ = log
    span = 10**18 + 10**9, 10**18 + 3 * 10**9
    whole = Read(data, *span)
    assert whole.said == []
    assert len(whole.messages) == 5
    for begin, _ in _chunks(data):
        times = range(8 * (begin + RECORD.size), 8 * (begin + RECORD.size + 16))
        for bit, changed in _flipped(data, times):
            read = Read(changed, *span)
            assert read.messages == whole.messages, bit
            assert read.said, bit


def test_an_index_that_is_not_that_of_its_chunk_is_said(log):
    """Without a summary as well: it tells what a damaged chunk has held."""
    data, _ = log
    whole = Read(data)
    indexes = [at for at in _boundaries(data) if at < len(data) and data[at] == Opcode.MESSAGE_INDEX]
    bits = [8 * (at + RECORD.size + byte) + 3 for at in indexes for byte in (0, 7, 20)]  # channel, time, offset
    for bit, changed in _flipped(data, bits):
        read = Read(changed)
        assert read.messages == whole.messages, bit
        assert read.said, bit


def test_cut_at_every_record_boundary_and_beside_it(log):
    data, _ = log
    whole = Read(data)
    for bound, step in itertools.product(_boundaries(data), (-1, 0, 1)):
        cut = data[: bound + step]
        if len(cut) >= len(data):
            continue
        read = Read(cut)
        n_whole = sum(
            begin + RECORD.size + RECORD.unpack_from(data, begin)[1] <= len(cut) for begin, _ in _chunks(data)
        )
        assert read.messages == whole.messages[: len(read.messages)]
        assert len(read.messages) >= 2 * n_whole
        assert not read.finished  # said by every consumer


def test_a_file_written_twice(log):
    data, finished = log
    whole = Read(data)
    read = Read(data + data)
    assert read.messages == 2 * whole.messages
    assert read.said
    assert not finished or any("goes on behind its end" in damage.what for damage in read.said)
    junk = Read(data + b"junk")
    assert junk.messages == whole.messages
    assert junk.said or not junk.finished


def test_two_logs_in_one_file_keep_their_topics(log, tmp_path, make):
    """Channels of the second have other numbers."""
    data, _ = log
    other = SegmentedLog(tmp_path, {}, LogSettings(keep_free=0), 0, 0.0)
    other.write(schemas.EVENT.encode(make.event()))
    other.write(schemas.ESTIMATE.encode(make.estimate(9)))
    other.close()
    (path,) = tmp_path.glob("*.mcap")
    second = path.read_bytes()
    both = Read(data + second)
    assert both.messages == Read(data).messages + Read(second).messages
    assert both.said


def test_two_chunks_swapped(log):
    data, _ = log
    whole = Read(data)
    for (a, b), (c, d) in itertools.combinations(_chunks(data)[1:], 2):
        read = Read(data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:])
        assert sorted(read.messages) == sorted(whole.messages)
        assert read.said
        assert read.missing == []


def test_a_chunk_taken_out_is_named_by_channel_count_and_time(log):
    data, finished = log
    whole = Read(data)
    for n, (begin, end) in enumerate(_chunks(data)[:-1]):
        for last in (end, begin + RECORD.size + RECORD.unpack_from(data, begin)[1]):  # with its indexes and without
            read = Read(data[:begin] + data[last:])
            gone = [m for m in whole.messages if m not in read.messages]
            assert read.said
            if n:  # the first defines the channels
                told = {one.topic: one.n for one in read.missing}
                if not finished and last == end:  # nothing tells of the last event, for nothing came behind it
                    gone = [
                        m for m in gone if m[0] in told or any(m[0] == k[0] and m[1] < k[1] for k in whole.messages)
                    ]
                assert told == {topic: 1 for topic, _, _ in gone}
                for one in read.missing:
                    assert (one.first_ns or 0) <= 10**18 + n * 10**9 <= (one.last_ns or 2**63)
    begin, end = _chunks(data)[-1]
    read = Read(data[:begin] + data[end:])
    assert bool(read.said) == finished
    assert read.finished == finished  # of an unfinished one nobody knows what came last: it says that it is unfinished
