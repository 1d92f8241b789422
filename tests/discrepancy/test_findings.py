"""What is said of an answer must not be stronger than the answer."""

from __future__ import annotations

import pytest
from click.testing import CliRunner
from ema_postflight.discrepancy import discrepancy

from ema.core import resources
from ema.core.errors import ConfigError
from ema.discrepancy.findings import Findings, FoundEffect, Gain

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


def test_a_set_is_as_sure_as_its_members_together():
    def said(confidence, *others):
        effect = FoundEffect("spring_load", confidence, others, {}, "a spring", "slow motion")
        return Findings("explained", [effect], GAIN).sentences()[0]

    assert said(0.95) == "A spring."
    assert said(0.6) == "Perhaps, with a confidence of 60% only: a spring (to be confirmed by slow motion)."
    assert said(0.49, "inertia") == "A spring (or inertia; told apart by slow motion)."
    assert said(0.1, "inertia").startswith("Perhaps, with a confidence of 20% only: a spring (or inertia;")


def test_what_was_found_before_is_not_overwritten(tmp_path):
    """Least of all a plant file that an earlier run has extended, and that is examined further."""
    plant, record, found = resources.config("actuator.yaml"), tmp_path / "flight.csv", tmp_path / "found"
    record.write_text("t [s],i_a [A]\n0,0\n1e-4,0\n")
    found.mkdir()
    (found / "extended.yaml").write_bytes(plant.read_bytes())
    words = ["--plant", str(found / "extended.yaml"), str(record), "--out", str(found)]
    with pytest.raises(ConfigError, match=r"extended\.yaml: exists, and is not overwritten"):
        CliRunner().invoke(discrepancy, words, catch_exceptions=False)
    assert (found / "extended.yaml").read_bytes() == plant.read_bytes()
