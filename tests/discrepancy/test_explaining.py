"""`--explain`: why not this cause, by the numbers of the answer."""

from __future__ import annotations

import pytest
from click.testing import CliRunner
from ema_postflight.discrepancy import discrepancy

from ema.core.errors import ConfigError
from ema.discrepancy.explaining import explain_cause
from ema.discrepancy.findings import Findings, FoundEffect, Gain

GAIN = Gain(0.1, 0.1, 0.1, 0.1, 0.1)
SPRING = FoundEffect("spring_load", 0.6, ("constant_load",), {}, "a spring", "a slow motion")
LOST = [
    {"name": "inertia + viscous_drag", "before": 9.0, "after": 3.0, "why": "leaves 3"},
    {"name": "inertia", "before": 9.0, "after": 5.0, "why": "leaves 5"},
]


@pytest.mark.parametrize(
    ("cause", "says"),
    [
        ("spring_load", "is the answer, with a confidence of 60%: a spring"),
        ("constant_load", "cannot tell it from spring_load; told apart by a slow motion"),
        ("inertia", "best as inertia + viscous_drag) and is not the answer: leaves 3"),
        ("cogging", "was not fitted: to first order"),
    ],
)
def test_every_cause_has_its_answer(tmp_path, cause, says):
    Findings("explained", [SPRING], GAIN, rejected=LOST).write(tmp_path / "findings.json")
    run = CliRunner().invoke(discrepancy, ["--out", str(tmp_path), "--explain", cause], catch_exceptions=False)
    assert run.exit_code == 0
    assert says in run.output


def test_nothing_was_fitted_where_noise_is_left():
    assert "is noise" in explain_cause(Findings("adequate", [], GAIN).as_dict(), "cogging")


def test_what_is_no_effect_is_refused_with_those_that_are():
    with pytest.raises(ConfigError, match=r"--explain frictoin: no such effect; there are .*viscous_drag"):
        explain_cause(Findings("adequate", [], GAIN).as_dict(), "frictoin")


@pytest.mark.parametrize(("content", "says"), [(None, "is not there"), ("{", "cannot be read"), ("[]", "no findings")])
def test_findings_that_are_not_there_are_said_in_one_line(tmp_path, content, says):
    if content is not None:
        (tmp_path / "findings.json").write_text(content)
    with pytest.raises(ConfigError, match=says):
        CliRunner().invoke(discrepancy, ["--out", str(tmp_path), "--explain", "cogging"], catch_exceptions=False)


def test_without_records_there_must_be_something_to_explain(tmp_path):
    run = CliRunner().invoke(discrepancy, ["--out", str(tmp_path)])
    assert run.exit_code == 2
    assert "RECORD... and --plant are needed" in run.output


def test_what_would_look_the_same_as_what_was_fitted_is_not_ruled_out():
    moved = {"said": "dry friction was fitted as 0.03 N m, the plant file says 0.01", "alike": ["inverter_drop"]}
    findings = Findings("adequate", [], GAIN, moved=moved)
    (agrees,) = findings.sentences()
    assert moved["said"] in agrees
    assert "inverter_drop is not ruled out" in explain_cause(findings.as_dict(), "inverter_drop")
    assert "is noise" in explain_cause(findings.as_dict(), "cogging")
