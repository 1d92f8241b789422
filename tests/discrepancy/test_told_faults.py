"""What the command says of an actuator's faults beside what its simulation lacks."""

from __future__ import annotations

from ema.discrepancy.findings import Gain

ERRORS = (0.05, 0.05, 0.05, 0.05, 0.01)
K = (0.06, 0.0, 1e-5, 0.045, 0.0, 0.08)


def told(*intervals):
    return Gain(*ERRORS, k_after=K, k_interval=intervals).told_faults


def test_faults_that_are_there_are_told_with_their_intervals_and_how_large_others_may_be():
    said = told((0.0596, 0.0603), (0.0, 3e-6), (0.0, 1.3e-4), (0.0443, 0.0453), (0.0, 1e-4), (0.0798, 0.0808))
    assert said == (
        "Faults: k1 (dry friction) 0.06 (0.0596 … 0.0603), k4 (short, phase B) 0.045 (0.0443 … 0.0453), "
        "k6 (eccentricity) 0.08 (0.0798 … 0.0808); no other above 0.00013."
    )


def test_where_there_may_be_none_it_is_told_how_large_they_may_be():
    assert told(*[(0.0, 2e-3)] * 6) == "Faults: none above 0.002."


def test_another_plant_has_no_faults():
    assert Gain(*ERRORS, k_after=(1.0,), k_interval=((0.9, 1.1),), k_names=("J",)).told_faults == ""
