"""The service files as files; what they do on a running systemd is in test_machine.py."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from ema_daemon.settings import load

from ema.core import resources

ROOT = Path(__file__).resolve().parents[2]
UNITS = ["ema-daemon@.service", "ema-hf-worker@.service"]
MOST_EXPOSURE = 1.2
NEWER_THAN_DEBIAN_12 = ("RestartSteps", "RestartMaxDelaySec")  # systemd 254; older ones warn and go on

needs_systemd_analyze = pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd-analyze here")


@needs_systemd_analyze
@pytest.mark.parametrize("unit", UNITS)
def test_exposure(unit, capsys):
    words = ["systemd-analyze", "security", "--offline=true", "--no-pager", resources.systemd(unit)]
    answer = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    (overall,) = [line for line in answer.splitlines() if "Overall exposure" in line]
    exposure = float(overall.partition(": ")[2].split()[0])
    with capsys.disabled():
        print(f"\n{unit}: exposure {exposure}")
    assert exposure <= MOST_EXPOSURE
    details = json.loads(subprocess.run([*words, "--json=short"], capture_output=True, check=True).stdout)
    assert details, "systemd-analyze judged nothing"


@pytest.mark.parametrize("unit", UNITS)
def test_no_core_file_holds_a_key(unit):
    assert "LimitCORE=0" in resources.systemd(unit).read_text().splitlines()


def test_the_worker_starts_restarts_and_stops_with_its_daemon():
    """What the two say to each other is that of one version: after an upgrade neither may stay behind."""
    worker = resources.systemd("ema-hf-worker@.service").read_text().splitlines()
    assert "PartOf=ema-daemon@%i.service" in worker
    assert "WantedBy=ema-daemon@%i.service" in worker
    upgrade = (ROOT / "tools/deb/postinst").read_text()
    assert "try-restart 'ema-daemon@*.service' 'ema-hf-worker@*.service'" in upgrade


@needs_systemd_analyze
@pytest.mark.parametrize("unit", UNITS)
def test_unit_is_understood(unit, tmp_path):
    text = resources.systemd(unit).read_text()
    program = next(line for line in text.splitlines() if line.startswith("ExecStart="))
    instance = tmp_path / unit.replace("@.", "@vcan0.")
    instance.write_text(text.replace(program, "ExecStart=/bin/true"))
    answer = subprocess.run(["systemd-analyze", "verify", instance], capture_output=True, text=True, check=False).stderr
    complaints = [line for line in answer.splitlines() if instance.name in line]
    assert [line for line in complaints if not any(key in line for key in NEWER_THAN_DEBIAN_12)] == []


@pytest.mark.slow
def test_install_and_uninstall_below_destdir(tmp_path):
    stage, wheels = tmp_path / "stage", tmp_path / "wheels"
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    copy = tmp_path / "source"  # setuptools builds inside the source tree
    shutil.copytree(
        ROOT, copy, ignore=shutil.ignore_patterns(".*", "__pycache__", "build", "dist", "*.egg-info", "out", "var")
    )
    subprocess.run([*pip, "--wheel-dir", wheels, copy], check=True)
    (wheel,) = wheels.iterdir()
    environment = {**os.environ, "DESTDIR": str(stage), "PYTHON": sys.executable}
    install = ROOT / "tools/install_service"
    subprocess.run([install, "install", wheel, "--no-deps"], env=environment, check=True, stdout=subprocess.DEVNULL)
    assert (stage / "usr/local/bin/ema").is_symlink()
    unit = (stage / "usr/local/lib/systemd/system/ema-daemon@.service").read_text()
    assert unit == resources.systemd("ema-daemon@.service").read_text()
    assert {path.name for path in resources.systemd("").iterdir() if path.suffix not in (".py", "")} <= {
        path.name for path in (stage / "usr/local/lib").rglob("*") if path.is_file()
    }
    program = (stage / "opt/ema-monitor/bin/ema").read_text()
    assert program.startswith("#!/opt/ema-monitor/bin/python")
    assert str(stage) not in program
    assert not list((stage / "opt/ema-monitor").rglob("site-packages/pip")), "the service never runs pip"
    _documented_steps(stage / "etc/ema", tmp_path)
    subprocess.run([install, "uninstall"], env=environment, check=True, stdout=subprocess.DEVNULL)
    left = [path for path in stage.rglob("*") if not path.is_dir()]
    assert {path.parent for path in left} == {stage / "etc/ema"}, "configurations are the user's, all else goes"


def _documented_steps(etc, tmp_path):
    """The steps of docs/service.md make a configuration of the example whose files are there."""
    steps = [line.strip() for line in (ROOT / "docs/service.md").read_text().splitlines() if line.startswith("    cp ")]
    assert len(steps) == 2
    (tmp_path / "bundle").mkdir()
    script = "\n".join(steps).replace("/etc/ema", str(etc))
    subprocess.run(["sh", "-euc", script], cwd=tmp_path, check=True)
    settings = load(etc / "vcan0.yaml")
    assert Path(settings.actuators[0].bundle) == etc / "bundle"
    assert Path(settings.actuators[0].bundle).is_dir()
    assert Path(settings.actuators[0].plant).is_file()
    assert settings.log.directory == "/var/log/ema/vcan0"
