"""The daemon without any privilege: as root without capabilities, which the kernel treats as anybody else."""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from ema.bus.codec import default
from ema.bus.interface import BusSettings, open_bus

EMA = Path(sys.executable).with_name("ema")
BARE = ["setpriv", "--bounding-set=-all", "--inh-caps=-all"] if os.geteuid() == 0 else []

pytestmark = pytest.mark.skipif(bool(BARE) and not shutil.which("setpriv"), reason="no setpriv (util-linux) here")


def refusal(*words):
    done = subprocess.run([*BARE, EMA, *words], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    return done.stderr


@pytest.fixture
def forbidden():
    """Takes rights away from a path, and gives them back in the end."""
    taken = []

    def make(path, mode):
        taken.append(path)
        path.chmod(mode)
        return path

    yield make
    for path in taken:
        path.chmod(0o755)


def test_a_log_directory_it_may_not_write_is_refused_by_the_kernel(write_config, tmp_path, forbidden):
    config = write_config()
    forbidden(tmp_path / "log", 0o555)
    assert "Permission denied" in refusal("daemon", "--config", config)


def test_a_key_it_may_not_read_is_refused(write_config, tmp_path, forbidden):
    key = tmp_path / "key"
    key.write_text("5a" * 16)
    forbidden(key, 0o000)
    said = refusal("daemon", "--config", write_config(bus={"interface": "virtual", "key_file": "key"}))
    assert f"key file {key}: cannot be read (Permission denied)" in said


def test_doctor_says_what_it_may_not(write_config, tmp_path, forbidden):
    config = write_config()
    forbidden(tmp_path / "log", 0o555)
    words = [*BARE, EMA, "doctor", "--config", config]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 1
    assert "cannot be written" in done.stdout
    assert "Traceback" not in done.stderr


def test_it_estimates_and_says_that_its_receive_buffer_is_small(write_config, frames):
    group = f"239.76.{os.getpid() % 200}.{os.getpid() // 200 % 200}"
    bus = {"interface": "udp_multicast", "channel": group}
    estimate = default().messages["EstimateLinear"]
    with open_bus(BusSettings(**bus), default().filters("Monitor")) as port:
        words = [*BARE, EMA, "daemon", "--config", write_config(bus=bus)]
        process = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
        try:
            while not port.read(60.0).size:
                assert process.poll() is None
            for part in np.array_split(frames[: frames.size // 6], 20):
                port.write(part)
                time.sleep(0.02)
            end, heard = time.monotonic() + 60, []
            while estimate.frame_id not in heard and time.monotonic() < end:
                heard += port.read(1.0)["id"].tolist()
        finally:
            process.terminate()
            _, said = process.communicate(timeout=60)
    assert estimate.frame_id in heard
    limit = int(Path("/proc/sys/net/core/rmem_max").read_text())
    assert ("set net.core.rmem_max" in said) == (limit < 8 << 20)
