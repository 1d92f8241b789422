"""Delays by the balances of measured signals, of records that other code has made."""

from __future__ import annotations

import pytest
from hidden_actuator import PLANTS

from benchmarks import strata
from benchmarks.strata import as_actuator
from ema.core.names import FAULTS
from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.examine import examine
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.reading.delays import see_delays


def seen(hidden, name, **flaws):
    """What two chirps of a plant show."""
    nominal = PLANTS[name]
    motion = hidden.chirp(2.5 / nominal.GR)
    cycles = hidden.cycles(hidden.Flaws(**flaws), 2, 4, (motion,), hidden.Bench(nominal=nominal))
    plant = as_actuator(nominal)
    return see_delays(plant, prepare(plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(cycles)))]))


@pytest.mark.parametrize("name", PLANTS)
@pytest.mark.parametrize("effect", ["position_delay", "controller_delay", "recorder_delay"])
def test_each_delay_is_told_apart_and_to_a_tenth_beside_faults(hidden, name, effect):
    found = seen(hidden, name, k1=0.04, k4=0.05, **{effect: 1.1e-3})
    assert found == {effect: pytest.approx(1.1e-3, rel=0.1)}


@pytest.mark.parametrize("name", PLANTS)
def test_a_delay_before_the_tap_and_one_of_the_recorder_are_told_beside_each_other(hidden, name):
    found = seen(hidden, name, position_delay=8e-4, recorder_delay=1.2e-3, k3=0.03)
    assert found == {"position_delay": pytest.approx(8e-4, rel=0.2), "recorder_delay": pytest.approx(1.2e-3, rel=0.2)}


@pytest.mark.parametrize("name", PLANTS)
@pytest.mark.parametrize(
    "flaws", [{}, {"k2": 0.06}, {"flux": -0.05}, {"speed_gain": -0.2}, {"viscous": 6e-5}, {"gain_a": 0.03}]
)
def test_what_is_no_delay_shows_none(hidden, name, flaws):
    assert seen(hidden, name, **flaws) == {}


@pytest.mark.slow
def test_a_late_position_that_turns_the_loop_round_is_named_beside_three_faults(hidden):
    """Beside the faults that were fitted without it, a simulation of it leaves more than one of drag."""
    trial = strata.drawn("beside faults", 5, 205111440)
    k = {name: x for name, x in zip(FAULTS, trial.k, strict=True) if x}
    made = hidden.cycles(hidden.Flaws(**trial.values, **k), 6, 11440, trial.motions, trial.bench)
    record = Record(tuple(Cycle(n, c) for n, c in enumerate(made)))
    found = examine(trial.actuator, prepare(trial.actuator, [record])).findings
    assert [e.name for e in found.effects] == ["position_delay"]
    assert found.verdict == "explained"
    assert found.effects[0].parameters["time"].value == pytest.approx(trial.values["position_delay"], rel=0.02)
    assert found.gain.k_after == pytest.approx(trial.k, abs=0.003)
