"""What fits better and is not named is told with its numbers; a bound that was too narrow is widened and said."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from ema.discrepancy.axis.finding import candidates
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.telling.dropped import list_dropped
from ema.discrepancy.folds import Folds
from ema.discrepancy.grade import Left
from ema.discrepancy.outcome import Outcome
from ema.discrepancy.selection import fit_base
from ema.effects import registry
from ema.effects.search import Span
from ema.models.axis_config import RotaryAxis


def looked(axis_bench, drag, seed=1):
    bench = axis_bench.Bench(C=2e-5 + drag)
    record = axis_bench.record(bench, np.random.default_rng(seed), duration=1.0)
    plant = AxisPlant(RotaryAxis.model_validate(axis_bench.PLANT), [record])
    point = fit_base(plant).fits[0].point
    tried = [{"name": "viscous_drag", "round": 1, "score": 1000.0, "error": 10.0, "rms": 1.0}]
    nothing = Folds((), (), (), (), ())
    left = Left(False, nothing, nothing)
    return plant, Outcome("unexplained", "", 0.0, [], {}, (0.0, 0.0), nothing, left, [], [], [], [], tried, point=point)


def test_a_parameter_at_its_bound_is_fitted_again_with_wider_ones(axis_bench, monkeypatch):
    narrow = replace(registry()["viscous_drag"], on_axis=lambda s: {"coefficient": Span(0.0, 2e-5, (1e-5,), 1e-5)})
    monkeypatch.setattr(candidates, "registry", lambda: {**registry(), "viscous_drag": narrow})
    (entry,) = list_dropped(*looked(axis_bench, drag=1e-4), named=set())
    assert entry["name"] == "viscous_drag"
    assert "the end of what is searched (0 … 2e-05)" in entry["why"]
    wider = re.search(r"10 times as wide viscous_drag.coefficient = (\S+) ", entry["why"])
    assert wider
    assert float(wider[1]) == pytest.approx(1e-4, rel=0.01)
    assert entry["after"] < entry["before"]


def test_what_is_named_or_takes_nothing_is_not_told(axis_bench):
    plant, outcome = looked(axis_bench, drag=1e-4)
    assert list_dropped(plant, outcome, named={"viscous_drag"}) == []
    assert list_dropped(*looked(axis_bench, drag=0.0), named=set()) == []
