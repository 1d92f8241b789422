"""The whole chain by its commands: records of other code, cause, extended plant, bundle, estimates."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
import yaml

from ema.core import resources
from ema.core.csv_records import write_csv
from ema.core.records import Cycle, Record

K = np.array([0.03, 0.0, 0.0, 0.0, 0.0, 0.0])


def ema(*words) -> str:
    """A command in a process of its own, as its users run it."""
    program = "from ema.cli import main; main()"
    run = subprocess.run([sys.executable, "-c", program, *map(str, words)], capture_output=True, text=True, timeout=500)
    assert run.returncode == 0, run.stderr[-1500:]
    return run.stdout


def err_k(answer: str) -> float:
    cycles = json.loads(answer)["records"][0]["cycles"]
    return float(np.mean([np.linalg.norm(np.array(c["k"]) - K) for c in cycles]) / np.sqrt(6.0))


@pytest.mark.slow
def test_from_a_record_to_better_estimates(hidden, coarse_bundle, tmp_path):
    """A weaker magnet: named, in the plant file, in a bundle, and no longer three shorts."""
    cycles = hidden.cycles(hidden.Flaws(flux=-0.06, k1=0.03), 3, 1, motions=(hidden.chirp(),))
    flight, found = tmp_path / "flight.csv", tmp_path / "found"
    write_csv(Record(tuple(Cycle(n, channels) for n, channels in enumerate(cycles))), flight)
    ema("discrepancy", flight, "--plant", resources.config("actuator.yaml"), "--out", found)
    extended = found / "extended.yaml"

    builder = coarse_bundle.manifest["builder"] | {"plant": str(extended)}
    (tmp_path / "builder.yaml").write_text(yaml.safe_dump(builder))
    ema("build", "--config", tmp_path / "builder.yaml", "--out", tmp_path / "bundle", "--workers", 2)
    before = err_k(ema("identify", "--bundle", coarse_bundle.path, "--method", "linear", flight, "--json"))
    after = err_k(ema("identify", "--bundle", tmp_path / "bundle", "--method", "linear", flight, "--json"))
    print(f"err_k {before:.4f} -> {after:.4f}")
    assert after < 0.25 * before
