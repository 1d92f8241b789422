"""Every benchmark of `make bench` runs, with the smallest settings that still do everything once."""

from __future__ import annotations

import importlib
import pkgutil

import pytest

import benchmarks
from benchmarks.__main__ import _cells

# Constants of the module, arguments of its rows().
SMALLEST = {
    "alarms": ({}, {"most": 2}),
    "bus": ({"ROUNDS": 1}, {}),
    "campaign": ({"N_RUNS": 32, "N_TASKS": 4}, {}),
    "daemon": ({}, {"actuators": (1,), "n_cycles": 1, "turns": ()}),
    "doubt": ({"FLIGHTS": 1, "CYCLES": 3, "EFFECTS": {}}, {}),
    "identification": ({"N": 2, "N_HF": 2, "N_INDEPENDENT": 2, "SETS": (0.05,)}, {}),
    "kernel": ({}, {}),
    "log": ({"N_SHORT": 3, "N_LONG": 8}, {}),
    "nuisance": ({"N": dict.fromkeys(("linear", "lf2", "lf1", "hf"), 2)}, {}),
    "prognosis": ({}, {"count": 30, "n_peer": 3}),
    "switching": ({"SEEDS": 4, "TRIED": ({"located": True, "dt": 5e-6},)}, {}),
}
LEFT_OUT = {"instructions"}  # compiles the kernel for another processor: a minute


def test_every_benchmark_with_rows_is_here():
    names = [m.name for m in pkgutil.iter_modules(benchmarks.__path__) if not m.name.startswith("_")]
    with_rows = {n for n in names if hasattr(importlib.import_module(f"benchmarks.{n}"), "rows")}
    assert with_rows == SMALLEST.keys() | LEFT_OUT


@pytest.mark.slow
@pytest.mark.parametrize("name", SMALLEST)
def test_it_gives_its_rows(name, coarse_bundle, flux_bundle, monkeypatch):
    module = importlib.import_module(f"benchmarks.{name}")
    constants, arguments = SMALLEST[name]
    for constant, value in constants.items():
        monkeypatch.setattr(module, constant, value)
    if hasattr(module, "quick_bundle"):
        monkeypatch.setattr(module, "quick_bundle", lambda *_, nuisance=(): flux_bundle if nuisance else coarse_bundle)
    monkeypatch.setattr("benchmarks.peers.measured", lambda plant: {"another simulator": None})
    rows = module.rows(**arguments)
    assert rows
    for row in rows:
        assert {"figure", "value", "unit"} <= row.keys()
        assert _cells(row)
