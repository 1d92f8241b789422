"""What is said of an answer must not be stronger than the answer."""

from __future__ import annotations

import pytest
from axe_look import BROWSER, look
from click.testing import CliRunner
from ema_postflight.discrepancy import discrepancy

from ema.core import resources
from ema.core.errors import ConfigError
from ema.core.version import version
from ema.discrepancy.findings import Findings, FoundEffect, Gain, Quantity
from ema.discrepancy.folds import Folds
from ema.discrepancy.report import write_report
from ema.effects import registry

GAIN = Gain(0.1, 0.1, 0.1, 0.1, 0.1)


def test_only_a_residual_that_is_noise_is_called_noise():
    (clean,) = Findings("adequate", [], GAIN).sentences()
    assert "agrees with the measurement" in clean
    (rest,) = Findings("adequate", [], GAIN, rest=1.12).sentences()
    assert "agrees" not in rest
    assert "1.12 times the noise" in rest
    assert "not noise" in rest
    (small,) = Findings("adequate", [], GAIN, rest=0.96).sentences()
    assert "no larger than noise" in small


def test_a_rest_beside_a_cause_is_told_where_it_can_be_seen():
    assert Findings("explained", [], GAIN, rest=1.02).sentences() == []
    (rest,) = Findings("explained", [], GAIN, rest=2.0).sentences()
    assert "2 times the noise" in rest
    assert Findings("explained", [], GAIN, rest=2.0).as_dict()["rest"] == 2.0


def test_a_cause_is_told_with_its_confidence_and_intervals():
    stiffness = {"stiffness": Quantity(2.0, 1.5, 2.5, "N m/rad"), "shape": Quantity(0.5, 0.5, 0.5, "1")}
    effect = FoundEffect("spring_load", 0.97, (), stiffness, "a spring", "slow motion")
    (said,) = Findings("explained", [effect], GAIN).sentences(numbers=True)
    assert said == "A spring. [P 0.97; stiffness 2 (1.5 … 2.5) N m/rad, shape 0.5]"
    pair = FoundEffect("spring_load", 0.48, ("inertia",), {}, "a spring", "slow motion")
    assert pair.numbers == " [P 0.96 for the set]"


@pytest.mark.parametrize(("of_error", "of_residual", "said"), [(0.2, 1.1, "error"), (0.1, 1.4, "residual")])
def test_of_two_rests_the_larger_is_told_and_which_it_is(of_error, of_residual, said):
    residual = Folds(("a",), (9.0,), (of_residual**2,), (1.0,), (1.0,))
    gain = Gain(1.0, 0.1, 1.0, of_error, 0.1, residual=residual)
    assert gain.told_rest.startswith(f"{max(of_error / 0.1, of_residual):.3g} times")
    assert said in gain.told_rest


def test_a_set_is_as_sure_as_its_members_together():
    def said(confidence, *others):
        effect = FoundEffect("spring_load", confidence, others, {}, "a spring", "slow motion")
        return Findings("explained", [effect], GAIN).sentences()[0]

    assert said(0.95) == "A spring."
    assert said(0.6) == "Perhaps, with a confidence of 60% only: a spring (to be confirmed by slow motion)."
    others = "; or inertia, or some of each (told apart by slow motion)."
    one_of = f"One of 2 that fit alike, this record cannot tell which: a spring{others}"
    assert said(0.49, "inertia") == one_of
    perhaps = f"Perhaps, with a confidence of 20% only: one of these, a spring{others}"
    assert said(0.1, "inertia") == perhaps


def test_an_experiment_is_told_in_full_once():
    lines = [FoundEffect("cogging", 0.5, ("external_torque",), {}, f"line {n}", "a slow turn") for n in (18, 36)]
    first, second = Findings("explained", lines, GAIN).sentences()
    assert "(told apart by a slow turn)" in first
    assert "(told apart likewise)" in second
    assert "line 36" in second


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


def test_what_is_explained_in_part_says_what_is_left():
    effect = FoundEffect("spring_load", 0.99, (), {}, "a spring", "slow motion")
    gain = Gain(1.0, 0.1, 1.0, 0.23, 0.1)
    named, rest = Findings("partly explained", [effect], gain, {"sentences": ["a torque even in speed"]}).sentences()
    assert named == "A spring."
    assert "2.3 times what noise makes" in rest
    assert "a torque even in speed" in rest


def test_findings_say_where_a_cause_acts_what_lost_and_what_made_them():
    recorder = registry()["recorder_gain"]
    effect = FoundEffect(recorder.name, 0.99, (), {}, "reads low", "both recorders", recorder.place)
    lost = {"name": "inertia", "before": 9.0, "after": 5.0, "why": "leaves 5"}
    said = Findings("explained", [effect], GAIN, rejected=[lost], seeds={"fit": 7}).as_dict()
    assert said["effects"][0]["place"] == "recorder"
    assert said["rejected"] == [lost]
    assert (said["version"], said["seeds"]) == (version(), {"fit": 7})


def test_a_size_is_so_many_deviations_from_nothing_and_a_place_or_a_shape_is_not():
    """By the side of the interval that no bound cuts off; of several sizes the surest."""
    line = {"amplitude": Quantity(0.01, 0.008, 0.012, "N m"), "order": Quantity(12.0, 11.9, 12.1, "")}
    gains = {f"gain_{p}": Quantity(x, x - 0.01, x + 0.01, "") for p, x in zip("abc", (0.0, -0.05, 0.01), strict=True)}
    of = {name: FoundEffect(name, 0.9, (), q, "", "") for name, q in (("cogging", line), ("current_gain", gains))}
    assert of["cogging"].z == pytest.approx(1.96 * 5.0)
    assert of["current_gain"].z == pytest.approx(1.96 * 5.0)
    cut = FoundEffect("cogging", 0.9, (), {"amplitude": Quantity(0.001, 0.0, 0.003, "N m")}, "", "")
    assert cut.z == pytest.approx(1.96 / 2.0)
    assert FoundEffect("cogging", 0.9, (), {"amplitude": Quantity(0.01, 0.01, 0.01, "N m")}, "", "").z is None
    said = Findings(
        "explained", [of["cogging"]], Gain(1, 1, 1, 1, 1, k_after=(0.1,), k_interval=((0.0, 0.2),))
    ).as_dict()
    assert said["effects"][0]["z"] == of["cogging"].z
    assert said["gain"]["k_interval"] == [[0.0, 0.2]]


def test_sensors_of_the_loop_and_of_the_recorder_are_different_effects():
    places = {name: effect.place for name, effect in registry().items()}
    assert places["current_gain"] == places["current_offset"] == places["controller_delay"] == "loop"
    assert places["recorder_gain"] == places["recorder_offset"] == places["recorder_delay"] == "recorder"
    assert places["cogging"] == "plant"


@pytest.mark.parametrize(
    ("others", "headline"), [((), "Explained."), (("inertia",), "Explained, by one of several that fit alike.")]
)
def test_the_report_says_the_set_where_there_is_one(others, headline, tmp_path):
    effect = FoundEffect(
        "spring_load",
        0.49 if others else 0.98,
        others,
        {"k": Quantity(1.0, 0.9, 1.1, "N m/rad")},
        "a spring",
        "slow motion",
    )
    write_report(tmp_path / "report.html", "bench", ["flight.csv"], Findings("explained", [effect], GAIN), [])
    text = (tmp_path / "report.html").read_text()
    assert headline in text
    assert ("0.98 for the set" in text) == bool(others)
    if BROWSER is not None:
        for screen in ((1280, 900, False), (390, 844, True)):
            seen = look(tmp_path / "report.html", *screen)
            assert seen["found"] == []
            assert not seen["wide"]


def test_rigid_body_terms_that_the_balance_has_are_never_nothing_that_stands_out():
    gain = Gain(0.1, 0.1, 0.1, 0.1, 0.01)
    (said,) = Findings("unexplained", [], gain, balance={"terms": [], "given": [{"name": "linked_axis"}]}).sentences()
    assert "what the balance shows" in said


def test_what_is_not_needed_and_not_ruled_out_is_told():
    sets = [{"effects": names, "probability": p} for names, p in (([], 0.55), (["winding_resistance"], 0.4))]
    agrees, may = Findings("adequate", [], GAIN, posterior=sets).sentences()
    assert "agrees" in agrees
    assert "winding_resistance (0.40)" in may
    assert len(Findings("adequate", [], GAIN, posterior=[{"effects": [], "probability": 0.97}]).sentences()) == 1


@pytest.mark.parametrize(("damping", "said"), [(0.06, "resonates (damping ratio 0.06)"), (1.4, "creeps after the")])
def test_a_gear_is_told_by_what_it_does(damping, said):
    assert said in registry()["gear_compliance"].said({"compliance": 4e-6, "damping": damping})
