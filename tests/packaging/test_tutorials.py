"""The tutorials' commands, executed one after the other as they stand."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

TUTORIALS = Path(__file__).parents[2] / "docs/tutorials"
ORDER = ("integrator", "tester", "analyst")


def _commands(name):
    return re.findall(r"^```sh\n(.*?)^```", (TUTORIALS / f"{name}.md").read_text(), re.S | re.M)


def test_no_tutorial_is_left_out():
    assert {path.stem for path in TUTORIALS.glob("*.md")} == set(ORDER)


@pytest.mark.slow
def test_the_commands_work_in_this_order(coarse_bundle, tmp_path):
    """On a multicast group of this test's own, and with a bundle that is already there (`ema build` has its tests)."""
    group = f"udp_multicast:239.76.{os.getpid() % 200}.{os.getpid() // 200 % 200 + 1}"
    shutil.copytree(coarse_bundle.path, tmp_path / "bundle")
    build = "ema build --config builder-quick.yaml --out bundle"
    assert build in _commands("integrator")[1]
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    said = {}
    for name in ORDER:
        script = "set -eu\n" + "\n".join(_commands(name)).replace("BUS=auto", f"BUS={group}").replace(
            "--bus auto", f"--bus {group}"
        )
        script = script.replace(build, "cp -r ../bundle .")
        environment = os.environ | {"PATH": path}
        done = subprocess.run(
            ["sh", "-c", script],
            cwd=tmp_path if name == ORDER[0] else tmp_path / "work",
            env=environment,
            capture_output=True,
            text=True,
            timeout=300,
        )
        assert done.returncode == 0, f"{name}: {done.stdout[-1500:]}\n{done.stderr[-1500:]}"
        said[name] = done.stdout + done.stderr
        assert "Traceback" not in said[name]
    assert "flush_interval" in said["integrator"]
    assert "exit status 2" in said["integrator"]
    assert "daemon running" in said["tester"]
    assert "frames sent in" in said["tester"]
    assert "the one the log was made with" in said["analyst"]
    for made in ("flight.html", "comparison.csv", "tables/PhaseCurrents.csv", "killed.recovered.mcap", "flight.asc"):
        assert (tmp_path / "work" / made).stat().st_size > 0, made
