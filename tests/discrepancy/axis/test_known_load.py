"""A load that was recorded is no missing effect; what it makes of friction is, from a bench of another hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ema.core.errors import RecordError
from ema.core.records import Record
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.reading.intake import take_in
from ema.models.axis_config import RotaryAxis

SHARE = 0.15  # of the load, that friction takes more
NOISE = 5e-4  # of the load cell [N m]


def load_at(t):
    """Of a test stand: none of its periods is of the motion. [N m]"""
    return 0.03 * np.sin(2.0 * np.pi * 0.8 * t + 0.4) + 0.015 * np.sin(2.0 * np.pi * 2.3 * t) + 0.01


def recorded(axis_bench, *, share, seed, with_load=True):
    rng = np.random.default_rng(seed)
    bench = axis_bench.Bench(
        torque=lambda theta, w, i, t: load_at(t),
        friction=lambda theta, w, i, t, direction: 1.0 + share * np.abs(load_at(t)) / 0.02,
    )
    record = axis_bench.record(bench, rng)
    if not with_load:
        return record
    cycles = (
        replace(c, channels={**c.channels, "load_torque": load_at(c["t"]) + NOISE * rng.standard_normal(c.n_samples)})
        for c in record
    )
    return Record(tuple(cycles))


def outcome(axis_bench, record):
    return examine_ways(AxisPlant(RotaryAxis.model_validate(axis_bench.PLANT), [record]))


@pytest.mark.slow
def test_a_load_that_was_recorded_raises_no_alarm(axis_bench):
    found = outcome(axis_bench, recorded(axis_bench, share=0.0, seed=11))
    assert found.verdict == "adequate"
    assert not found.effects


@pytest.mark.slow
@pytest.mark.further
def test_the_same_load_unrecorded_is_not_explained_away(axis_bench):
    found = outcome(axis_bench, recorded(axis_bench, share=0.0, seed=11, with_load=False))
    assert found.verdict in ("unexplained", "partly explained")
    assert not [e for e in found.effects if e["confidence"] > 0.9]


@pytest.mark.slow
def test_friction_that_grows_with_the_recorded_load_is_named_with_its_share(axis_bench):
    found = outcome(axis_bench, recorded(axis_bench, share=SHARE, seed=12))
    assert [e["name"] for e in found.effects] == ["output_load_friction"]
    (effect,) = found.effects
    assert effect["confidence"] > 0.9
    assert effect["parameters"]["share"]["low"] < SHARE < effect["parameters"]["share"]["high"]
    assert effect["parameters"]["share"]["value"] == pytest.approx(SHARE, rel=0.1)


def test_a_load_on_the_users_side_acts_over_the_gear_where_the_motor_is_measured(axis_bench):
    record = recorded(axis_bench, share=0.0, seed=1)
    geared = RotaryAxis.model_validate({**axis_bench.PLANT, "gear": 5.0})
    (taken,) = take_in(geared, [record])
    np.testing.assert_allclose(taken.cycles[0]["load_torque"], record.cycles[0]["load_torque"] / 5.0)
    (same,) = take_in(geared.model_copy(update={"measured_at": "load"}), [record])
    np.testing.assert_array_equal(same.cycles[0]["load_torque"], record.cycles[0]["load_torque"])


def test_a_force_is_no_load_of_a_rotary_axis_and_is_not_left_out_in_silence(axis_bench):
    cycles = (
        replace(c, channels={**{n: x for n, x in c.channels.items() if n != "load_torque"}, "load_force": c["t"]})
        for c in recorded(axis_bench, share=0.0, seed=11)
    )
    with pytest.raises(RecordError, match=r"load_force .* takes load_torque"):
        AxisPlant(RotaryAxis.model_validate(axis_bench.PLANT), [Record(tuple(cycles))])
