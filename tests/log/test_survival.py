"""A process killed, power lost, a disk filled: what the log still holds."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ema.log import LogReader, LogSettings, schemas
from ema.log.segmented import SegmentedLog

SUPPORT = Path(__file__).parents[1] / "support"


@pytest.mark.slow
def test_after_sigkill_at_a_random_moment_at_most_the_interval_is_missing(tmp_path):
    """And what this machine's disk or other jobs made each process wait, which the process measures itself."""
    program = [sys.executable, str(SUPPORT / "log_kill.py"), str(tmp_path), "100", "1"]
    result = json.loads(subprocess.run(program, check=True, capture_output=True, text=True).stdout)
    missing = np.array(result["missing"])
    print(
        f"SIGKILL: {result['trials']} trials, {result['segments']} segments, flush interval {result['interval']} s; "
        f"missing at most {missing.max():.3f} s, median {np.median(missing):.3f} s; "
        f"stalled for at most {max(result['stalled']):.3f} s"
    )
    assert result["trials"] == 100
    assert (missing <= result["interval"] + np.array(result["stalled"])).all()
    assert np.median(missing) <= result["interval"]


def test_after_a_power_cut_all_that_was_synced_is_there(tmp_path, make, monkeypatch):
    """Only what fdatasync has confirmed counts: the file is cut there, and each flush must have brought everything."""
    synced = {}
    sync = os.fdatasync

    def recording(descriptor):
        sync(descriptor)
        synced[os.readlink(f"/proc/self/fd/{descriptor}")] = os.fstat(descriptor).st_size

    monkeypatch.setattr("ema.log.segment.os.fdatasync", recording)
    log = SegmentedLog(tmp_path, {}, LogSettings(flush_interval=1, segment_time=4, keep_free=0), 0, 0.0)
    rng = np.random.default_rng(2)
    clock, flushed = 0.0, 0
    for cycle in range(200):
        log.write(schemas.ESTIMATE.encode(make.estimate(cycle)))
        clock += rng.uniform(0, 0.2)
        log.tick(cycle, clock)
        cut = tmp_path / f"cut-{cycle}"
        cut.mkdir()
        for path, size in synced.items():
            (cut / Path(path).name).write_bytes(Path(path).read_bytes()[:size])
        with LogReader(cut) as back:
            found = [m.content["cycle"] for m in back.messages()]
        assert found == list(range(len(found)))
        assert len(found) >= flushed
        flushed = max(flushed, len(found))
        assert cycle - len(found) < 10  # at most half the interval waits: 0.5 s of steps of 0.1 s on average
    log.close()


def on_small_disk(folder, script):
    """What a script of tests/support prints that logs into a file system of its own of 2 MB."""
    mounting = 'mount -t tmpfs -o size=2m none "$1" && exec "$2" "$3" "$1"'
    program = ["unshare", "--map-root-user", "--mount", "sh", "-c", mounting, "sh"]
    arguments = [str(folder), sys.executable, str(SUPPORT / script)]
    if subprocess.run(["unshare", "--map-root-user", "--mount", "true"], capture_output=True, check=False).returncode:
        pytest.skip("this kernel lets no user mount a small file system of their own (unshare)")
    return json.loads(subprocess.run(program + arguments, check=True, capture_output=True, text=True).stdout)


def test_a_folder_that_becomes_read_only_and_writable_again(tmp_path):
    """What is written before stays; what comes meanwhile is counted; afterwards the log goes on by itself."""
    result = on_small_disk(tmp_path, "log_read_only.py")
    states = result["states"]
    assert set(states[:10]) == {"OK"}
    assert set(states[11:29]) == {"FAILED"}
    assert set(states[31:]) == {"OK"}
    assert result["logged"] == result["accepted"]
    assert {*range(10), *range(32, 40)} <= set(result["logged"])
    assert "log_resumed" in result["events"]


def test_a_real_file_system_that_fills_and_empties(tmp_path):
    result = on_small_disk(tmp_path, "log_full_disk.py")
    states = result["states"]
    assert set(states[:9]) == {"OK"}
    assert set(states[12:29]) == {"FULL"}
    assert set(states[31:]) == {"OK"}
    assert result["damage"] == 0
    assert result["logged"] == result["accepted"]
