"""Records as the bus makes them, positions every millisecond, and faults that grow on the way."""

from __future__ import annotations

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.examine import examine
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.reading.sampling import between, positions_every


def from_the_bus(channels):
    """Every tenth position in steps of the frames' resolution, straight lines between them."""
    t = np.arange(len(channels["t"]))
    steps = {"theta_m": 2.0 * np.pi / 65536, "theta_u": 1.5e-5, "theta_cmd": 1.5e-5}
    seen = {name: step * np.round(channels[name][::10] / step) for name, step in steps.items()}
    return {**channels, **{name: np.interp(t, t[::10], x) for name, x in seen.items()}}


def record(cycles):
    return Record(tuple(Cycle(number, from_the_bus(c)) for number, c in enumerate(cycles)))


def test_positions_that_come_less_often_are_noticed(hidden):
    (cycle,) = hidden.cycles(hidden.Flaws(), 1, 3)
    assert positions_every(cycle["theta_m"]) == 1
    assert positions_every(from_the_bus(cycle)["theta_m"]) == 10


def test_the_command_is_known_better_than_its_resolution(hidden):
    command = hidden.chirp()
    seen = from_the_bus({name: command for name in ("t", "theta_m", "theta_u", "theta_cmd")})["theta_cmd"]
    assert np.std(between(seen, 10, 1.5e-5) - command) < 0.5 * np.std(seen - command)


@pytest.mark.slow
def test_a_sound_actuator_is_adequate_from_the_bus_too(hidden, shipped_plant):
    cycles = hidden.cycles(hidden.Flaws(k1=0.03), 3, 5, (hidden.chirp(),))
    findings = examine(shipped_plant, prepare(shipped_plant, [record(cycles)])).findings
    assert findings.verdict == "adequate"
    assert findings.gain.k_before == pytest.approx((0.03, 0.0, 0.0, 0.0, 0.0, 0.0), abs=0.006)


def warming(hidden, temperatures, *flaws):
    """One cycle of each actuator, with the winding's temperature beside it."""
    cycles = [hidden.cycles(f, 1, 5 + n, (hidden.chirp(),))[0] for n, f in enumerate(flaws)]
    return [{**c, "temp_w": np.full(len(c["t"]), x)} for c, x in zip(cycles, temperatures, strict=True)]


def told_ranges(findings):
    (told,) = (note for note in findings.notes if "change from cycle to cycle" in note)
    words = (r.split() for r in told.split(": ")[1].split(";")[0].split(", "))
    return {name: (float(low), float(high)) for name, low, _, high in words}


@pytest.mark.further
@pytest.mark.slow
def test_faults_that_grow_are_no_flaw_of_the_simulation_and_not_the_temperatures(hidden, shipped_plant):
    cycles = warming(hidden, (20.0, 35.0, 45.0, 50.0), *(hidden.Flaws(k1=0.02 * n, k3=0.03 * n) for n in range(4)))
    findings = examine(shipped_plant, prepare(shipped_plant, [record(cycles)])).findings
    assert findings.verdict == "adequate"
    assert findings.gain.k_before == pytest.approx((0.03, 0.0, 0.045, 0.0, 0.0, 0.0), abs=0.006)
    assert set(told_ranges(findings)) == {"k1", "k3"}


@pytest.mark.further
@pytest.mark.slow
def test_a_magnet_that_weakens_with_the_temperature_is_told_from_a_short_that_grows_with_it(hidden, shipped_plant):
    temperatures = (20.0, 32.0, 43.0, 50.0)
    flaws = [hidden.Flaws(k3=0.02 * n, flux=-0.0015 * (x - 20.0)) for n, x in enumerate(temperatures)]
    record_ = record(warming(hidden, temperatures, *flaws))
    findings = examine(shipped_plant, prepare(shipped_plant, [record_])).findings
    # Faults of each cycle are known within 0.002: of the last one that leaves 1.5 noise floors, and it would have been
    # the only one held out; over all of them it is 1.1.
    assert findings.verdict == "explained"
    assert findings.gain.folds.rest < 1.2
    assert findings.gain.folds.gain > 3.0 * findings.gain.folds.gain_error
    (found,) = findings.effects
    assert found.name == "magnet_flux"
    assert found.parameters["per_kelvin"].value == pytest.approx(-0.0015, rel=0.1)
    assert found.parameters["per_kelvin"].low < -0.0015 < found.parameters["per_kelvin"].high
    ranges = told_ranges(findings)
    assert set(ranges) == {"k3"}
    assert ranges["k3"] == pytest.approx((0.0, 0.06), abs=0.01)


@pytest.mark.slow
def test_an_effect_is_named_from_the_bus_too(hidden, shipped_plant):
    cycles = hidden.cycles(hidden.Flaws(viscous=6e-5, k1=0.03), 3, 5, (hidden.chirp(),))
    findings = examine(shipped_plant, prepare(shipped_plant, [record(cycles)])).findings
    assert [e.name for e in findings.effects] == ["viscous_drag"]
    assert findings.effects[0].parameters["coefficient"].value == pytest.approx(6e-5, rel=0.02)


@pytest.mark.further
@pytest.mark.slow
def test_effects_are_named_beside_faults_that_grow(hidden, shipped_plant):
    """Faults of each cycle stand for the drag too, at first; what grows is told as it does beside the drag."""
    flaws = [hidden.Flaws(viscous=6e-5, k1=0.02 * n, k3=0.03 * n) for n in range(6)]
    cycles = [hidden.cycles(f, 1, 5 + n, (hidden.chirp(),))[0] for n, f in enumerate(flaws)]
    findings = examine(shipped_plant, prepare(shipped_plant, [record(cycles)])).findings
    assert findings.verdict == "explained"
    assert [(e.name, e.indistinguishable_from) for e in findings.effects] == [("viscous_drag", ())]
    assert findings.effects[0].parameters["coefficient"].value == pytest.approx(6e-5, rel=0.05)
    assert findings.gain.k_after == pytest.approx((0.05, 0.0, 0.075, 0.0, 0.0, 0.0), abs=0.01)
    ranges = told_ranges(findings)
    assert ranges["k1"] == pytest.approx((0.0, 0.1), abs=0.01)
    assert ranges["k3"] == pytest.approx((0.0, 0.15), abs=0.01)
