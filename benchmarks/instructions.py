"""Instructions per step and run, counted by valgrind: the same number on a busy machine as on a quiet one.

    python -m benchmarks instructions

Counted for two numbers of steps; the difference is the kernel's alone. Valgrind knows no AVX-512, so the kernel is
compiled for a Haswell (AVX2, four lanes in a vector): to compare versions of the kernel by.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from typing import Any

import numpy as np

from ema.core import config, resources
from ema.models import hf
from ema.models.actuator import Actuator

TARGET = {
    "NUMBA_CPU_NAME": "haswell",
    "NUMBA_CPU_FEATURES": "+64bit,+avx,+avx2,+bmi,+bmi2,+cmov,+cx16,+f16c,+fma,+fsgsbase,+fxsr,+lzcnt,+mmx,+movbe,"
    "+popcnt,+sse,+sse2,+sse3,+sse4.1,+sse4.2,+ssse3",
}
BATCHES = {"one run": 1, "16 runs as lanes": 16}
SHORT, LONG = 11, 5001  # control ticks: many, since what starts and stops the count is counted too
HERE = (sys.executable, "-m", "benchmarks.instructions")
SEED = 1


def rows() -> list[dict[str, Any]]:
    figure, unit = "instructions of the HF kernel (AVX2)", "1/step/run"
    if shutil.which("callgrind_control") is None:
        return [{"figure": f"{figure}: valgrind is not installed", "value": None, "unit": unit}]
    subprocess.run([*HERE, "compile"], env={**os.environ, **TARGET}, check=True)  # before valgrind looks on
    plant = config.load(resources.config("actuator.yaml"), Actuator)
    n_steps = (LONG - SHORT) * round(1.0 / (plant.control.rate * hf.DT))
    return [
        {"figure": f"{figure}, {name}", "value": (counted(n, LONG) - counted(n, SHORT)) / (n_steps * n), "unit": unit,
         "seed": SEED}
        for name, n in BATCHES.items()
    ]  # fmt: skip


def counted(n: int, ticks: int) -> int:
    """Instructions of one simulation of `n` runs, and of starting and stopping the count."""
    count = ["valgrind", "--tool=callgrind", "--instr-atstart=no", "--callgrind-out-file=/dev/null"]
    command = [*count, *HERE, str(n), str(ticks)]
    done = subprocess.run(command, env={**os.environ, **TARGET}, capture_output=True, text=True, check=False)
    found = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode or not found:
        raise RuntimeError(f"{' '.join(command)}: {done.stderr.strip()[-500:]}")
    return int(found[1])


def _simulate(n: int, ticks: int) -> None:
    """One batch, counted; the one before it loads the kernel."""
    plant = config.load(resources.config("actuator.yaml"), Actuator)
    k, command = np.zeros((n, 6)), plant.command()
    hf.simulate(plant, k, command[:SHORT], seeds=SEED, noise=False)
    if ticks:
        _control("--instr=on")
        hf.simulate(plant, k, command[:ticks], seeds=SEED, noise=False)
        _control("--instr=off")


def _control(word: str) -> None:
    """Tell the valgrind this process runs in."""
    subprocess.run(["callgrind_control", word, str(os.getpid())], check=True, capture_output=True)


if __name__ == "__main__":
    if sys.argv[1:] == ["compile"]:
        for lanes in BATCHES.values():
            _simulate(lanes, 0)
    elif len(sys.argv) == 3:
        _simulate(int(sys.argv[1]), int(sys.argv[2]))
    else:
        sys.exit(f"python -m benchmarks instructions\n\n{__doc__}")
