"""Memory of a daemon with as many actuators as a bus can name."""

from __future__ import annotations

import json
import os
import re
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from ema_daemon.settings import load, load_bundles

from ema.bus.identifiers import N_ACTUATORS
from ema.bus.port import RECEIVE_BUFFER
from ema.core import resources

EMA = Path(sys.executable).with_name("ema")
LIMIT = 220e6  # resident [B]
PENDING = 8e6  # of a log that waits for a full disk [B]


@pytest.fixture
def copies(coarse_bundle, tmp_path):
    """Makes so many bundles of the same arrays in folders of their own; `differing`: each made by another builder."""

    def make(count, differing):
        made = {}
        for number in range(count):
            folder = tmp_path / f"bundle-{number}"
            folder.mkdir()
            for array in coarse_bundle.path.glob("*.npy"):
                (folder / array.name).symlink_to(array)
            manifest = json.loads((coarse_bundle.path / "manifest.json").read_text())
            manifest |= {"builder": manifest["builder"] | {"number": number}} if differing else {}
            (folder / "manifest.json").write_text(json.dumps(manifest))
            made[number] = {"bundle": str(folder)}
        return made

    return make


def test_bundles_of_the_same_contents_are_one(copies, write_config):
    alike = load_bundles(load(write_config(actuators=copies(3, differing=False))))
    assert alike[0] is alike[1] is alike[2]


def test_bundles_of_different_contents_are_not(copies, write_config):
    different = load_bundles(load(write_config(actuators=copies(3, differing=True))))
    assert len({id(bundle) for bundle in different.values()}) == 3


def test_64_actuators_each_with_a_bundle_of_its_own(copies, write_config, tmp_path):
    """The worst case: nothing to share. Socket buffer and pending log beside it fit into the unit's MemoryMax."""
    config = write_config(actuators=copies(N_ACTUATORS, differing=True))
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(tmp_path / "notify"))
        manager.settimeout(60)
        environment = {**os.environ, "NOTIFY_SOCKET": manager.getsockname()}
        process = subprocess.Popen([EMA, "daemon", "--config", config], env=environment, stderr=subprocess.DEVNULL)
        try:
            assert manager.recv(100) == b"READY=1"
            resident = int(re.search(r"VmRSS:\s+(\d+) kB", Path(f"/proc/{process.pid}/status").read_text())[1]) * 1024
        finally:
            process.kill()
            process.wait()
    assert resident < LIMIT
    unit = resources.systemd("ema-daemon@.service").read_text()
    allowed = int(re.search(r"^MemoryMax=(\d+)M$", unit, re.MULTILINE)[1]) * 2**20
    assert resident + 2 * RECEIVE_BUFFER + PENDING < allowed
