"""The process and what it stands on: killed, stopped, its files changed under it."""

from __future__ import annotations

import shutil
import signal
import subprocess
import time

import numpy as np
import pytest
from attacked import statuses

from ema.core.status import Lapse, LogState, ServiceState, Status
from ema.log import LogReader

FLUSH = 1.0  # interval of the log [s]


def test_sigkill(attack, tell, times):
    """Everything up to the flush interval is there, whenever it is killed."""
    n, rng, lost, open_ones = times(3, 50), np.random.default_rng(4), [], 0
    daemon = attack(log={"directory": "log", "flush_interval": f"{FLUSH:g} s"})
    for trial in range(n):
        if trial:
            daemon.start()
        time.sleep(float(rng.uniform(1.0, 2.5)))
        killed_ns = time.time_ns()
        daemon.process.kill()
        daemon.process.wait()
        newest = max(daemon.log.glob("*.mcap"), key=lambda path: path.stat().st_mtime_ns)
        with LogReader(newest) as log:
            last_ns = max(int(frames["t_ns"][-1]) for _, frames in log.frames())
            open_ones += bool(log.unfinished)
            assert not log.damage
        lost.append((killed_ns - last_ns) / 1e9)
    assert open_ones == n
    tell("SIGKILL at a random moment", n, "each log readable to its last flush, the process starts again",
         f"at most the last {max(lost):.2f} s of {FLUSH:g} s")  # fmt: skip


def test_stopped_and_continued(attack, tell):
    daemon = attack()
    daemon.until_state(ServiceState.RUNNING)
    daemon.signal(signal.SIGSTOP)
    time.sleep(2.0)
    daemon.signal(signal.SIGCONT)
    again = daemon.until_state(ServiceState.RUNNING)
    estimates = daemon.estimates(2)
    assert statuses(estimates)[-1] == Status.VALID
    assert daemon.stop() == 0
    tell("SIGSTOP for 2 s", 1, f"frames waited in the kernel; running again after {again:.1f} s", "nothing")


def test_the_bundle_is_overwritten_while_in_use(attack, tell, coarse_bundle, tmp_path):
    """Truncated in place and deleted: what was checked at the start is what is used."""
    mine = tmp_path / "bundle"
    shutil.copytree(coarse_bundle.path, mine)
    daemon = attack(actuators={0: {"bundle": str(mine)}})
    daemon.until_state(ServiceState.RUNNING)
    for path in mine.glob("*.npy"):
        path.write_bytes(b"")
    shutil.rmtree(mine)
    assert set(statuses(daemon.estimates(3))) == {Status.VALID}
    assert daemon.stop() == 0
    tell("the bundle is truncated, then deleted, under the daemon", 1, "valid as before: it holds what it has checked",
         "nothing")  # fmt: skip


def test_the_log_folder_is_deleted(attack, tell):
    daemon = attack()
    daemon.until_state(ServiceState.RUNNING)
    shutil.rmtree(daemon.log)
    late = daemon.until(lambda one: one.name == "Heartbeat" and one.values["log_state"] != LogState.OK)[1]
    assert set(statuses(daemon.estimates(2))) == {Status.VALID}
    daemon.log.mkdir()
    again = daemon.until(lambda one: one.name == "Heartbeat" and one.values["log_state"] == LogState.OK)[1]
    assert daemon.stop() == 0
    assert list(daemon.log.glob("*.mcap"))
    tell("the log's folder is deleted, later made again", 1,
         f"log failed, said after {late:.1f} s; estimates go on; logged again {again:.1f} s later",
         "what the folder held")  # fmt: skip


def test_the_log_folder_becomes_read_only(attack, tell):
    """No kernel remounts read-only what is open for writing: another read-only file system is laid over the folder."""
    if subprocess.run(["unshare", "--mount", "true"], capture_output=True, check=False).returncode:
        pytest.skip("mount namespaces are not to be had here: root has them")
    daemon = attack(within=["unshare", "--mount"])
    daemon.until_state(ServiceState.RUNNING)
    there = ["nsenter", "--target", str(daemon.process.pid), "--mount"]
    subprocess.run([*there, "mount", "-t", "tmpfs", "-o", "ro", "none", daemon.log], check=True)
    late = daemon.until_state(ServiceState.DEGRADED, Lapse.LOG)
    assert set(statuses(daemon.estimates(2))) == {Status.VALID}
    subprocess.run([*there, "umount", "--lazy", daemon.log], check=True)
    again = daemon.until_state(ServiceState.RUNNING)
    daemon.estimates(2)
    assert daemon.stop() == 0
    with LogReader(daemon.log) as log:
        assert not log.damage
        estimates = sum(m.topic == "/estimate/0/linear" for m in log.messages())
    n_lost = sum(one.name == "EstimateLinear" for one in daemon.said) - estimates
    tell("the log's folder becomes read-only for 3 s, then writable", 1,
         f"degraded, `log`, after {late:.1f} s; estimates go on; running {again:.1f} s after it is over; what there is "
         f"is sound", f"{n_lost} estimates of the log")  # fmt: skip


def test_signals_that_end_other_programs(attack, tell):
    """Each is decided: reread the configuration, cut the log, tell the state, or nothing."""
    daemon = attack()
    daemon.until_state(ServiceState.RUNNING)
    numbers = [signal.SIGHUP, signal.SIGUSR1, signal.SIGUSR2, signal.SIGQUIT, signal.SIGALRM, signal.SIGPIPE]
    for number in numbers:
        daemon.signal(number)
    assert set(statuses(daemon.estimates(2))) == {Status.VALID}
    assert daemon.stop() == 0
    names = ", ".join(number.name for number in numbers)
    tell(names, len(numbers), "estimates go on; what each is for: [the service](daemon.md)", "nothing")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_ended_in_mid_cycle(attack, tell, number):
    daemon = attack()
    daemon.until_state(ServiceState.RUNNING)
    daemon.signal(number)
    assert daemon.process.wait(60) == 0
    with LogReader(daemon.log) as log:
        assert not log.unfinished
        assert not log.damage
    assert daemon.events()[-1]["code"] == "stopped"
    tell(f"{number.name} in the middle of a cycle", 1, "answered, logged, finished, exit status 0", "nothing")
