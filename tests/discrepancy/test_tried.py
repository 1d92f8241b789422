"""Every effect of the library is tried by the search of each plant it exists for, where a record could show it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ema.core import config, resources
from ema.core.names import FAULTS
from ema.discrepancy.actuator.fitting import candidates as actuator
from ema.discrepancy.actuator.fitting import free
from ema.discrepancy.actuator.reading.gear import Resonance
from ema.discrepancy.actuator.reading.weak import ShownLine, ShownStretch
from ema.discrepancy.axis.finding import candidates as axis
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.finding.screened import SCREENED
from ema.effects import registry
from ema.effects.search import Look
from ema.models.actuator import Actuator
from ema.models.axis_config import RotaryAxis

NOT_TRIED = {
    "ema": {
        "position_torque": "a table: it holds a torque of no known cause, which a search describes but cannot name",
        "speed_torque": "a table, likewise",
    },
    "axis": {
        **dict.fromkeys(SCREENED, "tried where the balance of torque shows its law: test_axis_balance.py"),
        "external_torque": "told by what records given together differ in: test_axis_external.py",
    },
}


def of(plant):
    return {name for name, effect in registry().items() if plant in effect.plants}


def missed(plant, tried):
    untried = of(plant) - set(tried)
    assert untried >= set(NOT_TRIED[plant])  # a reason for what is tried after all would be out of date
    return untried - set(NOT_TRIED[plant])


def test_the_actuator(monkeypatch):
    """A record with everything in it: supply, warming, clipped currents, a resonance, a line, a stretch."""
    plant = config.load(resources.config("actuator.yaml"), Actuator)
    signals = SimpleNamespace(u_dc=np.full(100, 28.0), i=np.full((1, 3, 100), 5.0))
    data = SimpleNamespace(zero=0.0, dT=np.array([0.0, 30.0]), signals=[signals, signals], ranges=np.full(2, np.inf))
    resonance = Resonance(1e-3, 1e-3, damping=0.1, drag=1.0, friction=0.1, spring=9.0, k2=0.0, starts=np.zeros((2, 2)))
    monkeypatch.setattr(actuator, "lines", lambda torques: [ShownLine(18.0, 0.5, 3e-3, 4e-3)])
    monkeypatch.setattr(actuator, "bumps", lambda torques: [ShownStretch(0.01, 1e-3, 0.02)])
    both = ("cogging", "torque_line")
    found = [c for line in both for c in actuator.candidates(plant, data, [object()], line, resonance)]
    assert not missed("ema", {c.effect for c in found})
    for c in found:  # what a candidate switches on is told by its name: what is seen beside it is a candidate itself
        on = {name.split(".")[0] for name in c.start(np.zeros(len(c.amounts)))}
        assert on <= {c.effect, *FAULTS}, c.key


def test_the_axis(axis_bench):
    """A bench with voltage and supply, a torque line and a stretch of more friction."""
    bench = axis_bench.Bench(
        torque=lambda theta, w, i, t: 0.01 * np.sin(12.0 * theta),
        friction=lambda theta, w, i, t, direction: 1.0 + np.exp(-(((theta - 2.0) / 0.3) ** 2)),
    )
    record = axis_bench.record(bench, np.random.default_rng(1), duration=0.5)
    tried = set()
    for side in ("motor", "load"):  # of a gear that gives, on which the angle was measured
        plant = AxisPlant(RotaryAxis.model_validate({**axis_bench.PLANT, "measured_at": side}), [record])
        point = {free.name: free.start for free in plant.base}
        tried |= {c.effect for c in plant.candidates(point, range(len(plant.blocks)))}
    assert not missed("axis", tried)


def test_an_effect_of_a_file_more_is_tried_on_both_plants(monkeypatch, axis_bench):
    """What the file declares is all that a search needs; here of a drag by another name."""
    belt = replace(registry()["viscous_drag"], name="belt_drag")
    more = {**registry(), "belt_drag": belt}
    for module in (actuator, free, axis):
        monkeypatch.setattr(module, "registry", lambda: more)
    signals = SimpleNamespace(u_dc=None, i=np.full((1, 3, 100), 5.0))
    data = SimpleNamespace(zero=0.0, dT=np.zeros(2), signals=[signals, signals], ranges=np.full(2, np.inf))
    (c,) = [c for c in actuator.candidates(config.load(resources.config("actuator.yaml"), Actuator), data, [])
            if c.effect == "belt_drag"]  # fmt: skip
    (start,) = (p.start for p in belt.parameters)
    assert c.probes() == [{"belt_drag.coefficient": start}]
    record = axis_bench.record(axis_bench.Bench(), np.random.default_rng(1), duration=0.5)
    plant = AxisPlant(RotaryAxis.model_validate(axis_bench.PLANT), [record])
    found = {c.effect: c for c in axis.library(plant, {f.name: f.start for f in plant.base}, range(len(plant.blocks)))}
    assert found["belt_drag"].free[0].high == found["viscous_drag"].free[0].high


def test_a_look_at_what_is_no_parameter_is_refused():
    with pytest.raises(ValueError, match="belt_drag: a look at \\['stiffness'\\]"):
        replace(registry()["viscous_drag"], name="belt_drag", looks=(Look("stiffness"),))


@pytest.mark.parametrize("plant", NOT_TRIED)
def test_an_exception_is_an_effect_of_that_plant(plant):
    assert set(NOT_TRIED[plant]) <= of(plant)
