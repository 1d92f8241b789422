"""Cycles of the second simulator as the search has them; those that are refused; a command that is a sample late."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ema.core.errors import RecordError
from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.fitting.timing import find_samples_late
from ema.discrepancy.actuator.reading.checks import check_rate, check_signals
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.reading.features import Signals
from ema.discrepancy.actuator.reading.measured import Measured


@pytest.fixture(scope="module")
def cycles(hidden):
    return hidden.cycles(hidden.Flaws(), 3, 1, motions=(hidden.chirp(), hidden.triangle(4e-3, 3.0, 0.5)))


@pytest.fixture(scope="module")
def good(cycles):
    return cycles[0]


def signals(good, **changes):
    c = {**good, **changes}
    return Signals(
        np.stack([c[f"i_{x}"] for x in "abc"])[None], *(c[n][None] for n in ("theta_m", "theta_u", "theta_cmd")), None
    )


def test_cycles_of_one_command_are_one_motion_and_begin_where_they_begin(cycles, shipped_plant):
    found = prepare(shipped_plant, [Record(tuple(Cycle(k, c) for k, c in enumerate(cycles)))])
    assert isinstance(found, Measured)
    assert found.n_cycles == len(cycles) == len(found.y) == len(found.envelopes)
    assert found.motion.tolist() == [0, 1, 0]
    assert len(found.commands) == 2
    assert found.start[:, 1] == pytest.approx([c["theta_m"][0] for c in cycles], abs=1e-3)
    assert found.holding.mean(axis=1) == pytest.approx(np.zeros(3), abs=1e-9)
    assert not found.has_temperature
    assert (found.dT == 0.0).all()
    assert found.every == 1


def test_a_good_cycle_passes(good, shipped_plant):
    check_rate("here", Cycle(0, good), shipped_plant)
    check_signals("here", signals(good), shipped_plant)


def test_another_rate_and_a_gap_are_refused(good, shipped_plant):
    slow = {**good, "t": 2.0 * good["t"]}
    with pytest.raises(RecordError, match=r"sampled at 5000 Hz, the plant's recorder at 1e\+04 Hz"):
        check_rate("here", Cycle(0, slow), shipped_plant)
    late = good["t"] + np.where(np.arange(len(good["t"])) > 900, 0.02, 0.0)
    with pytest.raises(RecordError, match=r"gap of 0\.02"):
        check_rate("here", Cycle(0, {**good, "t": late}), shipped_plant)


def resting(good):
    return {"theta_u": np.full(len(good["t"]), 0.01)}


def without_current(good):
    return {"i_b": np.zeros(len(good["t"]))}


def geared_otherwise(good):
    return {"theta_m": 5.0 * good["theta_m"]}


def clipped(good):
    return {"i_a": np.clip(good["i_a"], -1.0, 1.0)}


def apart(good):
    return {f"i_{x}": np.roll(good[f"i_{x}"], 200) for x in "abc"}


def another_sign(good):
    return {f"i_{x}": -good[f"i_{x}"] for x in "abc"}


def of_something_else(good):
    """Currents under noise of another machine."""
    rng = np.random.default_rng(6)
    return {f"i_{x}": good[f"i_{x}"] + 6.0 * rng.standard_normal(len(good["t"])) for x in "abc"}


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (resting, "theta_u is constant"),
        (without_current, "i_b is constant"),
        (geared_otherwise, "another plant"),
        (clipped, "i_a is clipped at 1 A"),
        (apart, "the currents come 0.02 s after θ_m: channels are not synchronised"),
        (another_sign, "do not follow|not synchronised"),
        (of_something_else, "the currents do not follow θ_m"),
    ],
)
def test_what_does_not_belong_is_refused_with_its_reason(good, shipped_plant, change, why):
    with pytest.raises(RecordError, match=why):
        check_signals("here", signals(good, **change(good)), shipped_plant)


@pytest.mark.parametrize("late", [30, -30])
def test_a_delay_that_a_sensor_may_have_is_examined(good, shipped_plant, late):
    check_signals("here", signals(good, theta_u=np.roll(good["theta_u"], late)), shipped_plant)


class Late:
    """A plant whose features are its command, `late` samples late, beside something else that no shift takes."""

    def __init__(self, by: int, beside: float):
        rng = np.random.default_rng(2)
        self.command, self.late = np.cumsum(rng.standard_normal(500)), 0
        y = np.roll(self.command, by) + rng.standard_normal(500) + beside * 20.0 * rng.standard_normal(500)
        self.data = SimpleNamespace(y=[y])

    def n_seeds(self, cycles, at_least):
        return at_least

    def means(self, points, cycles, n_seeds, seed, steps=None):
        return [{c: np.roll(self.command, self.late) for c in cycles} for _ in points]


def found_late(by, beside=0.0):
    plant = Late(by, beside)
    noise = SimpleNamespace(
        of=lambda c: SimpleNamespace(white=lambda x: x),
        misfit=lambda left, cycles: sum(float(r @ r) for r in left) / 500,
    )
    late = find_samples_late(plant, noise, {}, [0])
    assert plant.late == 0  # as it was
    return late


@pytest.mark.parametrize("by", [-2, -1, 1, 2])
def test_a_command_beside_the_others_is_told_by_its_samples(by):
    assert found_late(by) == by


def test_a_command_in_time_is_left_there_and_one_that_explains_a_part_alone():
    assert found_late(0) == 0
    assert found_late(1, beside=1.0) == 0
