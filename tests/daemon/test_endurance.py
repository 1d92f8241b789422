"""The programs behind `make soak`, for a short while: what they print in earnest is in docs/reliability.md."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def run(program, bundle, *words):
    words = [sys.executable, "-m", f"benchmarks.{program}", "--bundle", bundle.path, *words]
    done = subprocess.run(words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    assert done.returncode == 0, done.stdout
    return done.stdout


@pytest.mark.slow
def test_every_cycle_of_a_short_soak_is_answered(coarse_bundle):
    assert "100 of 100 cycles estimated" in run("soak", coarse_bundle, "--cycles", "100")


@pytest.mark.slow
def test_sigkill_costs_at_most_the_flush_interval(coarse_bundle):
    assert "2 segments left open, all readable" in run("kills", coarse_bundle, "--trials", "2")
