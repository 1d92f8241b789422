"""The daemon's own log, damaged afterwards: never silently fewer messages."""

from __future__ import annotations

import hashlib
import subprocess

import numpy as np
import pytest
from attacked import EMA, SEED

from ema.core.errors import LogError
from ema.log import LogReader


@pytest.fixture
def log(attack):
    """A finished log of some cycles."""
    daemon = attack()
    daemon.estimates(3)
    assert daemon.stop() == 0
    (path,) = daemon.log.glob("*.mcap")
    return path


def content(path):
    """Digests of all that is read of a log, and what is said of it."""
    try:
        with LogReader(path) as log:
            found = {hashlib.sha256(repr((m.topic, m.content)).encode()).digest() for m in log.messages()}
            for _, frames in log.frames():
                found |= {frame.tobytes() for frame in frames}
            return found, [*log.complaints(), *map(str, log.unfinished)]
    except LogError as error:
        return set(), [str(error)]


def test_bits_of_the_log_are_flipped(log, tell, times, tmp_path):
    n, rng = times(60, 2000), np.random.default_rng(SEED)
    whole, said = content(log)
    assert said == []
    raw = log.read_bytes()
    n_lost = n_silent = 0
    copy = tmp_path / "copy.mcap"
    for bit in rng.integers(0, 8 * len(raw), n).tolist():
        damaged = bytearray(raw)
        damaged[bit // 8] ^= 1 << bit % 8
        copy.write_bytes(damaged)
        found, said = content(copy)
        lost = len(whole - found)
        n_lost += lost > 0
        n_silent += lost > 0 and not said
    assert n_silent == 0
    tell("one bit of the log is flipped", n, f"{n_lost} lost messages, each time it is said; silently: {n_silent}",
         "at most what the damaged chunk held")  # fmt: skip


def test_the_log_is_cut(log, tell, times, tmp_path):
    n, rng = times(20, 500), np.random.default_rng(SEED)
    whole, _ = content(log)
    raw, n_silent, copy = log.read_bytes(), 0, tmp_path / "copy.mcap"
    for length in rng.integers(0, len(raw), n).tolist():
        copy.write_bytes(raw[:length])
        found, said = content(copy)
        assert found <= whole
        n_silent += len(found) < len(whole) and not said
    assert n_silent == 0
    copy.write_bytes(raw[: len(raw) // 2])
    ran = subprocess.run([EMA, "recover", copy], capture_output=True, text=True, timeout=60, check=False)
    assert ran.returncode == 1, ran.stderr
    outcome = f"what is there is read, the rest is said; silently: {n_silent}"
    tell("the log is cut at any byte", n, outcome, "what was cut off")
