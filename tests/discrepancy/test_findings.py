"""What is said of an answer must not be stronger than the answer."""

from __future__ import annotations

from ema.discrepancy.findings import Findings, Gain

GAIN = Gain(0.1, 0.1, 0.1, 0.1, 0.1)


def test_only_a_residual_that_is_noise_is_called_noise():
    (clean,) = Findings("adequate", [], GAIN).sentences()
    assert "agrees with the measurement" in clean
    (rest,) = Findings("adequate", [], GAIN, rest=1.12).sentences()
    assert "agrees" not in rest
    assert "1.12 times the noise" in rest
    assert "not noise" in rest


def test_a_rest_beside_a_cause_is_told_where_it_can_be_seen():
    assert Findings("explained", [], GAIN, rest=1.02).sentences() == []
    (rest,) = Findings("explained", [], GAIN, rest=2.0).sentences()
    assert "2 times the noise" in rest
    assert Findings("explained", [], GAIN, rest=2.0).as_dict()["rest"] == 2.0
