"""What to record next: one sentence for each open question, none where all is told."""

from __future__ import annotations

from ema.discrepancy.axis.telling.next_records import next_records

SURE = {"value": 2.0, "low": 1.9, "high": 2.1, "unit": "", "plant_file": 2.0}
UNSURE = {**SURE, "low": -0.1}
BASE = {"inertia": SURE, "dry_friction": SURE, "viscous_drag": SURE}


def law(**more):
    term = {"name": "stribeck", "confidence": 0.99, "indistinguishable_from": [], "separated_by": "slow motion"}
    return {**term, **more}


def test_nothing_is_asked_for_where_all_is_told():
    assert next_records({"base": BASE, "terms": [law()]}) == []


def test_what_is_not_told_is_asked_for_by_the_motion_that_shows_it():
    base = {"inertia": SURE, "dry_friction": UNSURE}
    friction, drag = next_records({"base": base, "terms": []})
    assert friction == "dry friction is not told apart from what else acts: record slow motion in both directions"
    assert drag.startswith("drag cannot be told: record two constant speeds")


def test_a_value_that_no_machine_has_is_asked_for_again():
    base = {**BASE, "inertia": {**SURE, "low": -3.0, "high": -2.0, "implausible": "inertia cannot be negative"}}
    (said,) = next_records({"base": base, "terms": []})
    assert said.startswith("inertia is not told apart")


def test_a_set_and_a_perhaps_are_asked_for_by_what_separates_them():
    several = law(indistinguishable_from=["load_friction"])
    assert next_records({"base": BASE, "terms": [several]}) == ["stribeck and load_friction: record slow motion"]
    assert next_records({"base": BASE, "terms": [law(confidence=0.6)]}) == ["stribeck: record slow motion"]


def test_records_that_contradict_each_other_are_asked_for_again_without_a_change():
    own = {"name": "cogging", "law": "line 12", "agree": False, "shown_by": ["a"], "records": {"a": {}, "b": {}}}
    (said,) = next_records({"base": BASE, "terms": [], "by_record": [own]})
    assert said == "line 12: record a and b again, one after the other, nothing changed between"
    assert next_records({"base": BASE, "terms": [], "by_record": [{**own, "agree": True}]}) == []
