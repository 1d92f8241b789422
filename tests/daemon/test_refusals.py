"""What the daemon refuses before it starts: one line each, nothing overwritten."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from ema_daemon.assembly import assembled
from ema_daemon.settings import load

from ema.bus.codec import default
from ema.bus.interface import BusSettings, open_bus
from ema.core import resources
from ema.core.config import validate
from ema.core.errors import BundleError, BusError, ConfigError, EmaError, LogError


def refused(path):
    with assembled(load(path)):
        pass


def copy_of(bundle, tmp_path):
    return Path(shutil.copytree(bundle.path, tmp_path / "copy"))


def test_the_shipped_configuration_is_valid():
    assert load(resources.config("daemon.yaml")).actuators[0].plant == str(resources.config("actuator.yaml"))


def test_a_good_configuration_is_not_refused(write_config):
    refused(write_config())


@pytest.mark.parametrize(
    ("other", "message"),
    [
        ({"colour": "blue"}, "key 'colour' is unknown"),
        ({"actuators": {64: {"bundle": "b"}}}, "actuators.64"),
        ({"actuators": {}}, "actuators"),
        ({"actuators": None}, "key 'actuators' is missing"),
        ({"log": None}, "key 'log' is missing"),
        ({"pace": "3 V"}, "wrong unit"),
        ({"monitor": {"slower": {"lf2": {"every": 0}}}}, "greater than or equal to 0.01"),
        ({"monitor": {"slower": {"magic": {"every": 1}}}}, "identifier 'magic' is unknown"),
        ({"monitor": {"slower": {"lf1": {"every": 5}}}, "remote": {"lf1": "lf1.sock"}}, "no message for .* 'lf1'"),
        ({"remote": {"hf": "hf.sock"}}, "remote.hf is never asked: monitor.slower does not name 'hf'"),
        ({"monitor": {"model_check": {"cycles": 2, "failures": 3}}}, "can never happen"),
    ],
)
def test_configuration(write_config, other, message):
    with pytest.raises(ConfigError, match=message):
        refused(write_config(**other))


def test_missing_bundle(write_config, tmp_path):
    with pytest.raises(BundleError, match=r"nowhere: is not a bundle .* 'ema build'"):
        refused(write_config(actuators={0: {"bundle": str(tmp_path / "nowhere")}}))


def test_bundle_of_another_actuator(write_config, tmp_path, coarse_bundle):
    plant = yaml.safe_load(resources.config("actuator.yaml").read_text())
    plant["motor"]["R"] = 2.0
    (tmp_path / "other.yaml").write_text(yaml.safe_dump(plant))
    with pytest.raises(BundleError, match=r"was made for actuator .* with other parameters than .*other\.yaml"):
        refused(write_config(actuators={0: {"bundle": str(coarse_bundle.path), "plant": "other.yaml"}}))


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("order_of_k", ["k2", "k1", "k3", "k4", "k5", "k6"], "order of k"),
        ("version", 99, "version 99"),
        ("format", "cake", "not the manifest"),
    ],
)
def test_bundle_that_is_not_for_this_software(write_config, tmp_path, coarse_bundle, key, value, message):
    path = copy_of(coarse_bundle, tmp_path)
    manifest = json.loads((path / "manifest.json").read_text())
    manifest[key] = value
    (path / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(BundleError, match=message):
        refused(write_config(actuators={0: {"bundle": str(path)}}))


def test_damaged_bundle(write_config, tmp_path, coarse_bundle):
    path = copy_of(coarse_bundle, tmp_path)
    data = bytearray((path / "A.npy").read_bytes())
    data[-3] ^= 1
    (path / "A.npy").write_bytes(data)
    with pytest.raises(BundleError, match=r"A\.npy: is damaged"):
        refused(write_config(actuators={0: {"bundle": str(path)}}))


def test_log_directory_that_is_missing(write_config):
    with pytest.raises(LogError, match="nowhere"):
        refused(write_config(log={"directory": "nowhere"}))


def test_log_directory_that_cannot_be_written(write_config):
    with pytest.raises(LogError, match="/sys/kernel"):
        refused(write_config(log={"directory": "/sys/kernel"}))


@pytest.mark.parametrize("bus", [{"interface": "socketcan", "channel": "nocan7"}, {"interface": "telepathy"}])
def test_unknown_bus(write_config, bus):
    with pytest.raises(BusError, match=r"nocan7|telepathy"):
        refused(write_config(bus=bus))


NONSENSE = [99_999_999, -1, 10**400, 1.5, float("nan"), "many", [1], {"a": 1}, None, True, "\0"]


@pytest.mark.parametrize("value", NONSENSE, ids=lambda value: str(value)[:20])
@pytest.mark.parametrize("key", ["channel", "port", "group", "receive_buffer", "filters", "colour"])
@pytest.mark.parametrize("interface", ["udp_multicast", "socketcan", "virtual"])
def test_nonsense_as_an_option_of_the_bus_is_one_line_or_harmless(interface, key, value):
    """What is given to an interface is checked by it; whatever it says, it is one line of ours."""
    said = []
    channel, options = "239.78.7.7" if interface == "udp_multicast" else "nocan7", {}
    if key == "channel" and isinstance(value, str):
        channel = value
    elif key != "channel":
        options[key] = value
    try:
        said_otherwise = {"interface": interface, "channel": channel, "options": options}
        settings = validate(said_otherwise, BusSettings, "bus of daemon.yaml")
        open_bus(settings, default().filters("Actuator")).close()
    except EmaError as error:
        said.append(str(error))
    assert all(text.startswith("bus ") for text in said)


def test_the_user_sees_one_line(write_config, tmp_path):
    path = write_config(actuators={0: {"bundle": str(tmp_path / "nowhere")}})
    done = subprocess.run(
        [Path(sys.executable).with_name("ema"), "daemon", "--config", path], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("ema: ")
    assert not list((tmp_path / "log").iterdir())


@pytest.mark.parametrize("where", ["Service.run", "SegmentedLog.close"])
def test_what_fails_later_is_not_taken_for_a_bad_configuration(write_config, where):
    """Exit status 1: after 2 the service manager does not start it again."""
    code = f"""
import sys
from ema_daemon.service import Service
from ema.cli import main
from ema.core.errors import EmaError
from ema.log.segmented import SegmentedLog

def fail(self):
    raise EmaError("gone")

Service.run = Service.stop
{where} = fail
sys.argv[1:] = ["daemon", "--config", "{write_config()}"]
main()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (1, "ema: gone\n")


def test_the_process_stays_small():
    """Neither the compiler nor plots nor the HF model are in the daemon's process."""
    code = (
        "import sys; import ema_daemon.command; sys.modules.update(dict.fromkeys(ema_daemon.command.UNUSED)); "
        "import ema_daemon.assembly, ema.identification.lf2; "
        "heavy = {'numba', 'matplotlib', 'pandas', 'ema.effects', 'ema.models.hf', 'ema.discrepancy'}; "
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)
