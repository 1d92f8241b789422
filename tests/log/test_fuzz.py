"""Arbitrary bytes as logs: an answer or one LogError; no other exception, no hang, no growth."""

import contextlib
import tracemalloc

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ema.core.errors import LogError
from ema.log import LogReader, LogSettings, schemas
from ema.log.recovery import recover
from ema.log.segmented import SegmentedLog

FUZZ = settings(max_examples=300, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


@pytest.fixture(scope="module")
def whole(tmp_path_factory, make):
    """The bytes of a small sound log."""
    directory = tmp_path_factory.mktemp("log")
    log = SegmentedLog(directory, {"a.dbc": b"x"}, LogSettings(keep_free=0), 0, 0.0)
    for n in range(4):
        log.frames(make.frames(3, seed=n), "vcan0")
        log.write(schemas.ESTIMATE.encode(make.estimate(n)))
        log.tick(0, n + 1.0)
    log.close()
    return next(directory.iterdir()).read_bytes()


def _read_everything(directory, data):
    path = directory / "fuzz.mcap"
    path.write_bytes(data)
    target = directory / "recovered.mcap"
    target.unlink(missing_ok=True)
    with contextlib.suppress(LogError):
        with LogReader(path) as log:
            for _ in log.messages(lambda topic: True):
                pass
            for batch in log.frames():
                assert batch.frames.dtype.names
            log.attachments()
            log.metadata()
            assert log.unfinished in ([], [path])
        recover(path, target)


@FUZZ
@given(data=st.binary(max_size=300))
def test_noise(tmp_path_factory, data):
    directory = tmp_path_factory.getbasetemp()
    _read_everything(directory, data)
    _read_everything(directory, b"\x89MCAP0\r\n" + data)


@FUZZ
@given(
    edits=st.lists(st.tuples(st.floats(0, 1), st.binary(min_size=1, max_size=9)), min_size=1, max_size=6),
    cut=st.floats(0, 1),
)
def test_a_log_written_over_in_places(tmp_path_factory, whole, edits, cut):
    data = bytearray(whole)
    for place, patch in edits:
        at = int(place * (len(data) - 1))
        data[at : at + len(patch)] = patch
    _read_everything(tmp_path_factory.getbasetemp(), bytes(data[: max(8, int(cut * len(data)))]))


@FUZZ
@given(seed=st.integers(0, 2**32 - 1))
def test_lengths_and_sizes_of_any_value(tmp_path_factory, whole, seed):
    """Eight-byte fields are where a reader asks for memory."""
    rng = np.random.default_rng(seed)
    data = bytearray(whole)
    for at in rng.integers(8, len(data) - 8, 3):
        value = [0, 1, 2**31, 2**32 - 1, 2**63, 2**64 - 1][rng.integers(6)]
        data[at : at + 8] = value.to_bytes(8, "little")
    tracemalloc.start()
    try:
        _read_everything(tmp_path_factory.getbasetemp(), bytes(data))
        assert tracemalloc.get_traced_memory()[1] < 20_000_000
    finally:
        tracemalloc.stop()
