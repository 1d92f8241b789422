"""The whole chain, with a bundle that is already there."""

from __future__ import annotations

import csv
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from ema_demo.stage import Files

EMA = Path(sys.executable).with_name("ema")


def demo(out, *words):
    return subprocess.run([EMA, "demo", "--out", out, *words], capture_output=True, text=True, timeout=300)


def earlier(out, bundle):
    """A folder in which a demo has already built its bundle."""
    Files(out).prepare()
    shutil.copytree(bundle.path, out / "bundle")


@pytest.mark.slow
@pytest.mark.parametrize("bus", ["own group", "virtual"])
def test_from_a_bundle_to_a_picture(coarse_bundle, tmp_path, bus):
    out = tmp_path / "out"
    earlier(out, coarse_bundle)
    if bus == "own group":
        bus = f"udp_multicast:239.74.{os.getpid() % 200}.{os.getpid() // 200 % 200 + 1}"
    for name in ("truth.csv", "estimates.csv", "estimates.png"):
        (out / name).write_text("of an earlier demo")
    done = demo(out, "--bus", bus, "--cycles", "3")
    assert done.returncode == 0, done.stderr
    assert "is used again" in done.stderr
    assert "are the same again, bit for bit" in done.stdout
    rows = list(csv.DictReader((out / "estimates.csv").read_text().splitlines()))
    assert [row["cycle"] for row in rows] == list("012")
    assert {row["linear status"] for row in rows} <= {"valid", "degraded"}
    assert (out / "estimates.png").read_bytes().startswith(b"\x89PNG")
    assert len(list((out / "log").glob("*.mcap"))) == 1
    for name in ("estimates.csv", "estimates.png", ".mcap"):
        assert name in done.stdout


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--bus", "nocan7"], "ema: bus socketcan:nocan7 cannot be opened"),
        (["--cycles", "1"], "ema: Invalid value for '--cycles'"),
    ],
)
def test_wrong_use_is_one_line(coarse_bundle, tmp_path, words, message):
    earlier(tmp_path, coarse_bundle)
    done = demo(tmp_path, *words)
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith(message)
    assert "Traceback" not in done.stderr


def test_a_folder_that_cannot_be_used(tmp_path):
    (tmp_path / "file").write_text("precious")
    done = demo(tmp_path / "file")
    assert done.returncode == 2
    assert "cannot be used as output folder" in done.stderr
    assert (tmp_path / "file").read_text() == "precious"


def test_a_folder_of_somebody_else_is_left_as_it_is(tmp_path):
    mine = [tmp_path / name for name in ("daemon.yaml", "scenario.yaml", "truth.csv", "log/ema-flight.mcap")]
    (tmp_path / "log").mkdir()
    for path in mine:
        path.write_text("precious")
    done = demo(tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith(f"ema: {tmp_path}: was not made by 'ema demo'")
    assert done.stderr.count("\n") == 1
    assert [path.read_text() for path in mine] == ["precious"] * 4
