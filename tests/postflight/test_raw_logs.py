"""Exports of raw frames: what was written is read back the same, or refused in words; never fewer in silence."""

import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner
from ema_postflight.export import export
from ema_postflight.raw_logs import write_frames
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ema.core import frames as raw
from ema.core.errors import LogError
from ema.core.frames import FrameFlag
from ema.log import LogReader, LogSettings
from ema.log.foreign import ForeignLog
from ema.log.segmented import SegmentedLog

FORMATS = [".asc", ".blf", ".log", ".csv", ".db", ".trc", ".mcap", ".mf4"]
CLASSIC, FD = FrameFlag(0), FrameFlag.FD
# What no reader gets back from the format as python-can writes it.
CANNOT = {
    ".trc": FrameFlag.FD | FrameFlag.REMOTE | FrameFlag.ERROR,
    ".csv": FrameFlag.FD,
    ".db": FrameFlag.FD,
    ".asc": FrameFlag.ERROR,
    ".log": FrameFlag.ERROR,
}
LENGTHS = {CLASSIC: range(9), FD: (*range(9), 12, 16, 20, 24, 32, 48, 64)}
KINDS = (CLASSIC, FrameFlag.REMOTE, FrameFlag.ERROR, FD, FD | FrameFlag.BRS, FD | FrameFlag.BRS | FrameFlag.ESI)


@st.composite
def frames(draw):
    """A few frames of any kind that a bus carries."""
    kinds = draw(st.lists(st.sampled_from(KINDS), min_size=1, max_size=4))
    batch = raw.empty(len(kinds))
    batch["t_ns"] = 1_741_943_700_000_000_000 + 1_000_000 * np.arange(len(kinds))
    for frame, kind in zip(batch, kinds, strict=True):
        length = draw(st.sampled_from(LENGTHS[kind & FD]))
        if kind & FrameFlag.ERROR:  # eight bytes of the kernel, as SocketCAN has them
            length, extended = 8, False
        else:
            extended = draw(st.booleans())
        frame["id"] = draw(st.integers(0, 2**29 - 1 if extended else 2**11 - 1))
        frame["flags"] = int(kind) | (int(FrameFlag.EXTENDED) if extended else 0)
        frame["length"] = length
        if not kind & FrameFlag.REMOTE:
            data = draw(st.binary(min_size=length, max_size=length))
            frame["data"][:length] = np.frombuffer(data, np.uint8)
    return batch


def _log(directory, batch):
    for old in directory.glob("*.mcap"):
        old.unlink()
    log = SegmentedLog(directory, {}, LogSettings(keep_free=0), 0, 0.0)
    log.frames(batch, "vcan0")
    log.close()
    return LogReader(directory)


@pytest.mark.parametrize("suffix", FORMATS)
@settings(max_examples=25, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(batch=frames())
def test_written_and_read_back_are_equal_or_it_is_refused(tmp_path_factory, suffix, batch):
    if suffix == ".mf4":
        pytest.importorskip("asammdf")
    base = tmp_path_factory.getbasetemp() / f"raw{suffix}"
    (base / "log").mkdir(parents=True, exist_ok=True)
    out = base / f"f{suffix}"
    out.unlink(missing_ok=True)
    cannot = CANNOT.get(suffix, FrameFlag(0))
    with _log(base / "log", batch) as log:
        try:
            n = write_frames(log, out)
        except LogError:
            assert list(base.iterdir()) == [base / "log"]
            remote, fd = ((batch["flags"] & flag) != 0 for flag in (FrameFlag.REMOTE, FrameFlag.FD))
            odd = {".log": remote & (batch["length"] > 0), ".asc": fd & (batch["length"] == 0)}
            assert (batch["flags"] & cannot).any() or odd[suffix].any()
            return
    assert n == len(batch)
    assert not (batch["flags"] & cannot).any()
    with LogReader(out) if suffix == ".mcap" else ForeignLog(out) as back:
        read = np.concatenate([b.frames for b in back.frames()])
    for name in ("id", "length", "data"):
        assert np.array_equal(read[name], batch[name])
    assert np.array_equal(read["flags"] & 0x3F, batch["flags"] & 0x3F)
    since = [f["t_ns"].astype(np.int64) - int(f["t_ns"][0]) for f in (read, batch)]
    assert np.abs(since[0] - since[1]).max() < 2000  # asc and log have microseconds


@pytest.mark.parametrize(("suffix", "what"), [(".trc", "CAN FD frames"), (".csv", "CAN FD frames"), (".db", "CAN FD")])
def test_a_format_without_can_fd_is_refused_in_words_and_leaves_no_file(flight, tmp_path, suffix, what):
    answer = CliRunner().invoke(export, [str(flight), "--out", str(tmp_path / f"f{suffix}")])
    assert isinstance(answer.exception, LogError)  # exit status 2
    assert f"f{suffix}: cannot hold {what}" in str(answer.exception)
    assert "choose .blf" in str(answer.exception)
    assert list(tmp_path.iterdir()) == []


def test_a_log_of_our_own_is_opened_without_what_reads_those_of_other_tools():
    """Half a second of each command."""
    code = "import sys, ema_postflight.open_log; assert not {'can', 'asammdf', 'pandas'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)
