"""What a drive does between samples is decided where nothing but noise is left too: causes are told apart by it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import geared
import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.axis.finding import between
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.selection import Tried
from ema.models.axis_config import RotaryAxis

SMALL = geared.Axis(J=1.1e-5, F=7e-3, C=4.7e-6, k_t=0.0125)


pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def outcome():
    """A torque that reads 15 % too much, held between its samples; that of a heavier axis is straight and as good."""
    (cycle,) = geared.record(replace(SMALL, reads=1.15), 7, seconds=8.0, size=0.7, loop=(40.0, 0.025)).cycles
    channels = dict(cycle.channels)
    channels["torque"] = SMALL.k_t * channels.pop("i_q")
    declared = {**geared.plant(SMALL), "drive": "torque", "k_t": None, "C": SMALL.C, "fitted": []}
    model = RotaryAxis.model_validate({k: v for k, v in declared.items() if v is not None})
    return examine_ways(AxisPlant(model, [Record((Cycle(0, channels),))], n_threads=1))


@pytest.mark.further
def test_a_torque_that_reads_too_much_is_no_heavier_axis(outcome):
    told = {name for e in outcome.effects for name in (e["name"], *e["indistinguishable_from"])}
    assert "drive_gain" in told
    assert outcome.verdict == "explained"


def test_a_held_drive_is_told(outcome):
    assert any("held until the next" in note for note in outcome.notes)


def _outcome(left, *effects):
    model = Tried((), (), (), (np.full((1, 4000), left),))
    return SimpleNamespace(effects=effects, model=model, records=[SimpleNamespace(rms_before=40.0, rms_after=left)])


@pytest.mark.parametrize(
    ("one", "other", "is_taken"),
    [(2.0, 1.2, True), (2.0, 1.9, False), (0.8890, 0.8892, False), (1.001, 1.0002, False)],
)
def test_another_way_with_more_effects_is_taken_where_it_leaves_far_less_than_noise_makes(one, other, is_taken):
    """A drive that is held leaves what noise makes, and so does one that runs straight and is late by half a sample.

    Where the noise was told too large both leave less than one, and less than half of a negative rest was "far less".
    So was less than half of a thousandth.
    """
    assert between._is_simpler(_outcome(other, "drag", "late"), _outcome(one, "drag")) == is_taken
