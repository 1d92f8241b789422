"""The disk fills up under the daemon: it goes on estimating, says so, and logs again when there is room."""

import errno
import subprocess

import pytest

from ema.bus.socketcan import SocketCanPort
from ema.core.status import LogState
from ema.log import LogReader


@pytest.fixture
def small_disk(tmp_path):
    """A log folder on a disk of its own of 6 MB."""
    folder = tmp_path / "log"
    folder.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=6M", "tmpfs", folder], check=True)
    yield folder
    subprocess.run(["umount", "--lazy", folder], check=True)


def fill(disk):
    with (disk / "filler").open("wb", buffering=0) as file, pytest.raises(OSError, match="No space") as full:
        _write_without_end(file)
    assert full.value.errno == errno.ENOSPC


def _write_without_end(file):
    while True:
        file.write(bytes(4096))


def test_disk_full_and_free_again(daemon_on_vcan0, small_disk, tmp_path, vcan0, fly):
    flight = [frames for _, frames in fly(n_cycles=3)]
    daemon = daemon_on_vcan0(tmp_path, keep_free=0)
    with SocketCanPort(vcan0, filters=[]) as node:

        def send(number):
            assert node.write(flight[number]) == len(flight[number])
            daemon.estimate(number)

        send(0)
        fill(small_disk)
        daemon.next("Heartbeat", lambda beat: beat["log_state"] == LogState.FULL)
        send(1)
        assert daemon.next("Heartbeat")["log_state"] == LogState.FULL
        (small_disk / "filler").unlink()
        daemon.next("Heartbeat", lambda beat: beat["log_state"] == LogState.OK)
        send(2)
    assert daemon.stop() == 0
    with LogReader(small_disk) as log:
        cycles = [m.content["cycle"] for m in log.messages(lambda topic: topic == "/estimate/0/linear")]
        codes = [m.content["code"] for m in log.messages(lambda topic: topic == "/event")]
        assert log.damage == []
    assert cycles == [0, 1, 2]  # what a full disk refuses is kept for a while
    assert "log_resumed" in codes
