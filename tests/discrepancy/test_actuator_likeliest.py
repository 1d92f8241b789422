"""The score has the last word: where the search's answer is unlikely, the likeliest set that was fitted is told."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.actuator import examine as whole
from ema.discrepancy.actuator.finding.paths import Path
from ema.discrepancy.actuator.fitting.candidates import candidates
from ema.discrepancy.actuator.fitting.free import K_FREE
from ema.discrepancy.actuator.fitting.model import Model
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.scoring import likeliest
from ema.discrepancy.engine.contest import Outcome
from ema.discrepancy.engine.posterior import Entry

DRAG = 7e-5
STARTS = {"viscous_drag": {"viscous_drag.coefficient": DRAG}, "inertia": {"inertia.change": 0.1}}
# What the search does to its answer before it is weighed, and where among its arguments that answer stands.
LEAVE_AS_IT_IS = {"settle_at_minimum": 1, "drop_faults": 2, "simplify": 2,
                  "drop_constant_parts": 1, "take_resolver_zero": 1}  # fmt: skip


def led_to(name):
    """A search that fits both causes and ends at `name`."""

    def search_is_led(search, paths):
        data, fitted = search.plant.data, {}
        for c in candidates(search.plant.plant, data, []):
            if c.effect in STARTS:
                fitted[c.effect] = search.model((c,), (*K_FREE, *c.frees), STARTS[c.effect], None, 2)
        after = fitted[name]
        path = Path.of(search, paths[0].before)
        return replace(path, tried=list(search.tried), after=after, verdict=search.verdict(after), alike=[()])

    return search_is_led


@pytest.mark.parametrize(
    ("p", "named"),
    [
        ({("drag", "magnet_flux"): 0.004, ("drag",): 0.996}, False),  # faults do as well, and are far likelier
        ({("drag", "magnet_flux"): 0.3, ("drag",): 0.7}, True),  # a set of both
        ({("drag", "magnet_flux"): 0.9, ("drag",): 0.1}, True),
        ({("drag", "magnet_flux"): 0.01, ("drag", "inertia"): 0.9, ("drag",): 0.09}, True),  # an effect, either
        ({("drag", "magnet_flux"): 0.2, ("drag", "inertia"): 0.1, ("drag", "clock_skew"): 0.7}, False),
    ],
)
def test_an_effect_that_faults_are_far_likelier_than_is_not_named(p, named):
    outcome = Outcome([Entry(causes, of, 0.0, 0.0) for causes, of in p.items()], [])
    answer = Model(tuple(SimpleNamespace(effect=name) for name in ("drag", "magnet_flux")), None, 1.0)
    assert likeliest.is_named(outcome, answer, "magnet_flux", "inertia", "k4 and k5 alike") == named


def test_what_stands_beside_an_effect_by_now_is_no_rival_of_it():
    """The set with that "in its place" is the set without the effect, however likely."""
    sets = {("recorder_gain",): 0.999, ("recorder_gain", "magnet_flux"): 0.001}
    outcome = Outcome([Entry(causes, p, 0.0, 0.0) for causes, p in sets.items()], [])
    answer = Model(tuple(SimpleNamespace(effect=name) for name in ("recorder_gain", "magnet_flux")), None, 1.0)
    assert not likeliest.is_named(outcome, answer, "magnet_flux", "recorder_gain")


def test_of_effects_in_one_place_the_likeliest_is_named_first():
    found, alike = ("asymmetric_friction", "cogging"), [("constant_load", "play"), ()]
    assert likeliest.led_by(("constant_load", "cogging"), found, alike) == [("asymmetric_friction", "play"), ()]
    assert likeliest.led_by(("cogging", "constant_load"), found, alike) == [(), ("asymmetric_friction", "play")]
    assert likeliest.led_by(found, found, alike) == alike
    assert likeliest.led_by(("cogging",), found, alike) is None
    assert likeliest.led_by(("inertia", "cogging"), found, alike) is None
    assert likeliest.led_by(("constant_load", "cogging", "inertia"), found, alike) is None


def test_what_is_not_unlikely_in_the_place_of_an_effect_is_told():
    pair, other = ("viscous_drag", "stribeck"), ("quadratic_drag", "stribeck")
    sets = {pair: 0.6, ("viscous_drag", "quadratic_drag"): 0.3, other: 0.03, ("viscous_drag",): 0.07}
    outcome = Outcome([Entry(causes, of, 0.0, 0.0) for causes, of in sets.items()], [])
    found = likeliest.with_likely(("stribeck", "viscous_drag"), [("position_friction",), ("inertia",)], outcome)
    assert found == [("position_friction", "quadratic_drag"), ("inertia",)]  # two were not weighed


def test_what_does_as_well_by_misfit_and_is_unlikely_by_the_score_is_not_told():
    pair, heavier = ("viscous_drag", "magnet_flux"), ("viscous_drag", "inertia")
    outcome = Outcome(
        [Entry(c, p, 0.0, 0.0) for c, p in {pair: 0.96, ("viscous_drag",): 0.02, heavier: 0.02}.items()], []
    )
    alike = [(), ("k3 and k4 and k5 alike", "inertia", "clock_skew")]
    assert likeliest.with_likely(pair, alike, outcome) == [(), ("clock_skew",)]


def test_what_was_heard_is_never_weighed_by_its_first_fit_again(monkeypatch):
    """Of two models of one set the last stands for both, and only the settled one is at its minimum."""

    def model(*names, **more):
        return SimpleNamespace(names=names, effects=names, excess=0.0, is_full=False, **more)

    nothing, first, other, settled, beside, rival = (
        model(),
        model("clock_skew"),
        model("cogging"),
        model("clock_skew"),
        model("clock_skew", "play"),
        model("inertia"),
    )
    noise = SimpleNamespace(is_noise=True)
    outcome = Outcome([Entry(("clock_skew",), 1.0, 0.0, 0.0)], [])
    weighed = []

    def weigh_sets(search, before, answer, others):
        weighed.append((answer, list(others)))
        return outcome, [answer]

    for name, does in {
        "fit_faint_effects": lambda search, m, n: [first, other] if m is nothing else [beside],
        "weigh_sets": weigh_sets,
        "hear": lambda outcome, models, found: (first, ()) if found is nothing else None,
        "_go_on_from_heard": lambda *of: likeliest.Answer(settled, noise, [()]),
        "_fit_unweighed": lambda *of: [rival],
        "keep_alike": lambda search, m, j, rivals: rivals,
    }.items():
        monkeypatch.setattr(likeliest, name, does)
    quiet = likeliest.Answer(nothing, noise, [])
    _, answer, _ = likeliest.take_likeliest(None, SimpleNamespace(before=nothing), quiet)
    assert answer.model is settled
    assert weighed == [(nothing, [first, other]), (settled, [other, beside]), (settled, [other, beside, rival])]


@pytest.mark.slow
def test_the_likeliest_set_takes_the_place_of_an_unlikely_answer(hidden, shipped_plant, monkeypatch):
    """Led to a heavier rotor where there is drag, with real noise, fits and contest on two short cycles."""
    alone = lambda search, start: [Path.of(search, search.model((), K_FREE, start, None, 2))]  # noqa: E731
    monkeypatch.setattr(whole, "begin_with_faults_alone", alone)
    monkeypatch.setattr(whole, "find_growing_faults", lambda search, before: None)
    monkeypatch.setattr(whole, "choose_path", led_to("inertia"))
    for step, at in LEAVE_AS_IT_IS.items():
        monkeypatch.setattr(whole, step, lambda *of, at=at: (of[at], of[at + 1]))
    cycles = hidden.cycles(hidden.Flaws(viscous=DRAG), 2, 1, (hidden.chirp(),))
    record = Record(tuple(Cycle(number, channels) for number, channels in enumerate(cycles)))
    findings = whole.examine(shipped_plant, prepare(shipped_plant, [record])).findings
    (effect,) = findings.effects
    assert effect.name == "viscous_drag"
    assert effect.confidence > 0.9
    found = effect.parameters["coefficient"]
    assert found.low < DRAG < found.high
    assert effect.z > 5.0
    assert findings.verdict == "explained"
    lost = next(row for row in findings.rejected if row["name"] == "inertia")
    assert lost["nats"] > 5.0
    assert lost["nats_of"] == "evidence"
    assert "nats behind viscous_drag by the evidence of the record" in lost["why"]
    assert [low for low, _ in findings.gain.k_interval] == pytest.approx([0.0] * 6, abs=5e-3)
