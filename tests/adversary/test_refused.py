"""What a daemon cannot use it refuses at its start: one line, exit status 2, nothing changed, within seconds."""

from __future__ import annotations

import os
import shutil
import subprocess

import numpy as np
import pytest
import yaml
from attacked import EMA, PATIENCE, group, refusal


@pytest.fixture
def files(tmp_path, coarse_bundle):
    """A bundle and a log folder of its own, a sound configuration of them."""
    shutil.copytree(coarse_bundle.path, tmp_path / "bundle")
    (tmp_path / "log").mkdir()
    return {"bus": group(), "actuators": {0: {"bundle": "bundle"}}, "log": {"directory": "log"}}


def npz_as_npy(folder, _):
    np.savez(folder / "x.npz", A=np.zeros(3))
    (folder / "x.npz").replace(folder / "bundle/A.npy")


def half_a_manifest(folder, _):
    path = folder / "bundle/manifest.json"
    path.write_text(path.read_text()[:200])


def one_bit_of_an_array(folder, _):
    path = folder / "bundle/i0.npy"
    raw = bytearray(path.read_bytes())
    raw[-1] ^= 1
    path.write_bytes(raw)


def key(*path, value):
    """Sets one key of the configuration."""

    def change(_, content):
        for name in path[:-1]:
            content = content.setdefault(name, {})
        content[path[-1]] = value

    return change


ATTACKS = {
    "an .npz given as .npy": npz_as_npy,
    "half a manifest": half_a_manifest,
    "one bit of the bundle": one_bit_of_an_array,
    "a UDP port of 99999999": key("bus", "options", value={"port": 99999999}),
    "a log folder that is a file": key("log", "directory", value="daemon.yaml"),
    "pace: NaN": key("pace", value=float("nan")),
    "pace: -1 s": key("pace", value="-1 s"),
    "pace: 1 kg": key("pace", value="1 kg"),
    "timeout: inf": key("monitor", "timeout", value=float("inf")),
    "queue: 1e9": key("queue", value=10**9),
    "an actuator number of 64": key("actuators", value={64: {"bundle": "bundle"}}),
    "an unknown key": key("monitor", "speed", value=1),
}


@pytest.mark.parametrize("name", ATTACKS)
def test_a_file_or_key_that_cannot_be_used(tmp_path, files, tell, name):
    ATTACKS[name](tmp_path, files)
    config = tmp_path / "daemon.yaml"
    config.write_text(yaml.safe_dump(files))
    said = refusal("--config", config).replace(str(tmp_path), "…")
    assert not list((tmp_path / "log").glob("*.mcap"))
    tell(name, 1, f"refused: “{said[:140]}”", "nothing")


@pytest.mark.parametrize("kind", ["/dev/zero", "a FIFO", "a folder", "1 MB of brackets"])
def test_a_configuration_that_is_no_file_of_its_kind(tmp_path, tell, kind):
    path = tmp_path / "daemon.yaml"
    if kind == "a FIFO":
        os.mkfifo(path)
    elif kind == "a folder":
        path.mkdir()
    elif kind == "/dev/zero":
        path.symlink_to(kind)
    else:
        path.write_text("[" * 1_000_000)
    said = refusal("--config", path).replace(str(tmp_path), "…")
    tell(f"a configuration that is {kind}", 1, f"refused: “{said[:140]}”", "nothing")


def test_a_folder_another_daemon_logs_to(attack, tell, tmp_path):
    first = attack()
    content = yaml.safe_load(first.config.read_text()) | {"bus": group()}
    second = first.folder / "second.yaml"
    second.write_text(yaml.safe_dump(content))
    said = refusal("--config", second).replace(str(tmp_path), "…")
    assert first.stop() == 0
    tell("a second daemon on the same log folder", 1, f"refused: “{said[:140]}”", "nothing")


def test_a_second_monitor_of_the_same_actuator(attack, tell, tmp_path):
    first = attack()
    (first.folder / "log-2").mkdir()
    content = yaml.safe_load(first.config.read_text()) | {"log": {"directory": "log-2"}}
    second = first.folder / "second.yaml"
    second.write_text(yaml.safe_dump(content))
    ran = subprocess.run(
        [EMA, "daemon", "--config", second], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert ran.returncode in (1, 2), ran.stderr
    said = [line for line in ran.stderr.splitlines() if line][-1]
    assert "monitor" in said
    assert first.estimates(1)
    tell("a second monitor of the same actuator", 1, f"it refuses: “{said[:140]}”; the first goes on", "nothing")
