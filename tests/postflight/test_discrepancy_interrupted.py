"""Ctrl-C, or SIGTERM, writes what is known, marked as unfinished, in a real process."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from ema.core.csv_records import write_csv

EMA = Path(sys.executable).with_name("ema")


@pytest.fixture(scope="module")
def bench(tmp_path_factory, support):
    """A plant file and a record with a drag that the plant does not have."""
    axis_other, folder = support("axis_other"), tmp_path_factory.mktemp("bench")
    setup = axis_other.replace(axis_other.BASE, hidden=(1e-4, *(0.0,) * 7))
    (folder / "plant.yaml").write_text(yaml.safe_dump(axis_other.plant(setup)))
    write_csv(axis_other.record(setup, 1), folder / "record.csv")
    return folder


def interrupted_at(bench, out, text, times=1, by=signal.SIGINT):
    """The exit status and standard output of a run that gets a signal when a line of its progress has `text`."""
    words = [EMA, "discrepancy", "--plant", bench / "plant.yaml", bench / "record.csv", "--out", out]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    seen = 0
    for line in process.stderr:
        seen += text in line
        if seen == times:
            process.send_signal(by)
            break
    said, errors = process.communicate(timeout=120)
    assert seen == times, "the run ended before the moment"
    assert "Traceback" not in errors
    assert errors.strip().splitlines()[-1] == "ema: interrupted"
    return process.returncode, said


@pytest.mark.parametrize(("times", "by"), [(1, signal.SIGINT), (4, signal.SIGINT), (3, signal.SIGTERM)])
def test_what_leads_is_written_and_marked(bench, tmp_path, times, by):
    status, said = interrupted_at(bench, tmp_path / "out", "of held-out parts", times, by)
    assert status == 130
    found = json.loads((tmp_path / "out" / "findings.json").read_text())
    assert found["unfinished"] is True
    assert found["verdict"] == "unfinished"
    assert found["effects"] == []
    assert found["gain"]["heldout"]["err_after"] is None
    left = [t["left"] for t in found["leading"]]
    assert left == sorted(left)
    assert left
    assert "Unfinished" in (tmp_path / "out" / "report.html").read_text()
    assert not (tmp_path / "out" / "extended.yaml").exists()
    assert said.startswith("Unfinished: nothing is decided yet.")


def test_before_anything_was_fitted_there_is_nothing_to_write(bench, tmp_path):
    status, _ = interrupted_at(bench, tmp_path / "out", "the drive between samples")
    assert status == 130
    assert list((tmp_path / "out").iterdir()) == []


def test_findings_are_whole_when_only_the_pictures_are_missing(bench, tmp_path):
    status, _ = interrupted_at(bench, tmp_path / "out", "pictures")
    assert status == 130
    found = json.loads((tmp_path / "out" / "findings.json").read_text())
    assert "unfinished" not in found
    assert [e["name"] for e in found["effects"]] == ["viscous_drag"]
    assert "<img" not in (tmp_path / "out" / "report.html").read_text()
