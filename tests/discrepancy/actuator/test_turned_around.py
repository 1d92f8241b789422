"""Motions recorded once each: what only the held-out ones show is fitted there."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from trials import examine_drawn

from ema.discrepancy.actuator.examine import shows_held_out_only
from ema.discrepancy.actuator.fitting.model import Model

SEED = 1586679763  # a filter of the currents with its corner 1.3 times as high, on the light actuator; k2, k5


@pytest.mark.parametrize(
    ("motions", "train", "heldout", "expected"),
    [
        ([0, 1, 2, 3], 1.03, 90.0, True),
        ([0, 1, 2, 3], 1.03, 1.04, False),  # noise everywhere
        ([0, 1, 2, 3], 40.0, 90.0, False),  # training shows it too
        ([0, 0, 0, 0], 1.03, 90.0, False),  # the same motion: no effect does that
    ],
)
def test_the_split_is_turned_around_where_only_held_out_motions_show_it(motions, train, heldout, expected):
    plant = SimpleNamespace(data=SimpleNamespace(motion=np.array(motions)))
    search = SimpleNamespace(plant=plant, train=[0, 2], heldout=[1, 3])
    assert shows_held_out_only(search, Model((), SimpleNamespace(misfit=train), heldout)) == expected


@pytest.mark.further
@pytest.mark.slow
def test_a_filter_that_training_motions_do_not_show_is_named():
    """Three motions that leave 1.03 of noise and three that leave 90: fits to the first had gained nothing."""
    a, made = examine_drawn("recorder", 3, SEED)
    findings = made.findings
    assert findings.verdict == "explained"
    (found,) = findings.effects
    assert found.name == "current_filter"
    assert found.confidence > 0.9
    assert findings.gain.k_after == pytest.approx(a.k, abs=3e-3)
