"""Real benches: what the page shows is what the rows say, and a joint's published coefficients come back."""

from __future__ import annotations

import json
import re

import pytest

from benchmarks import real_benches, real_tables
from benchmarks.frozen import ROOT
from benchmarks.frozen_table import MixedCommitsError

PAGE = ROOT / "docs" / "real-data.md"
MISSED = 1.5  # half intervals of 95 %, beyond which a coefficient is not that of the makers


def newest():
    """The rows that the page shows."""
    (name,) = set(re.findall(r"<!-- rows (real-\w+\.jsonl) -->", PAGE.read_text(encoding="utf-8")))
    text = (ROOT / "benchmarks" / "trials" / name).read_text(encoding="utf-8")
    return [json.loads(line) for line in text.splitlines()]


def test_the_page_shows_the_tables_of_its_rows():
    page = PAGE.read_text(encoding="utf-8")
    assert real_tables.fill(newest(), page) == page


def test_every_bench_of_the_folder_is_in_the_rows():
    wanted = [(bench["bench"], bench["records"]) for bench in real_benches.benches()]
    assert [(row["bench"], row["records"]) for row in newest()] == wanted


def test_rows_of_two_commits_make_no_table():
    first, *others = newest()
    with pytest.raises(MixedCommitsError):
        real_tables.fill([{**first, "commit": "b" * 40}, *others], None)


def test_published_coefficients_are_those_of_the_equations_of_motion():
    """A mass point at the end of a rod without mass: m l², and its weight."""
    of = {"m1": 0.0, "m2": 2.0, "l1": 0.3, "r1": 0.0, "r2": 0.5, "I1": 0.0, "I2": 0.5, "Ir": 0.0, "gr": 6.0}
    of |= {"b1": 0.1, "b2": 0.2, "cf1": 0.0, "cf2": 0.0}
    elbow, shoulder = (real_benches.published(of, joint) for joint in ("elbow", "shoulder"))
    assert elbow["inertia"] == elbow["linked_axis.inertia"] == 0.5
    assert shoulder["inertia"] == pytest.approx(0.5 + 2.0 * 0.3**2)
    assert shoulder["linked_axis.gravity"] == pytest.approx(2.0 * 9.81 * 0.3)
    assert elbow["linked_axis.coupling"] == pytest.approx(2.0 * 0.3 * 0.5)


@pytest.mark.slow
@pytest.mark.parametrize("joint", ["DFKI C.0, elbow", "DFKI A.0, shoulder"])
def test_a_joint_has_the_makers_coefficients_and_nothing_that_is_not_there(joint):
    """A stretch in which friction drives had been told of the shoulder, and took a fifth from its gravity."""
    row = real_benches.examined(next(b for b in real_benches.benches() if b["bench"] == joint))
    assert row["exit"] == 0
    assert {e["name"] for e in row["effects"]} == {"linked_axis"}
    for name, truth in row["published"].items():
        q = real_tables.found(row, name)
        assert abs(q["value"] - truth) < MISSED * 0.5 * (q["high"] - q["low"]), name


@pytest.mark.slow
@pytest.mark.parametrize("record", ["chirp1", "noise1", "impulse1"])
def test_an_input_that_is_sampled_too_slowly_is_refused_in_one_sentence(record):
    bench = next(b for b in real_benches.benches() if b["records"] == [f"odrive_maxon_umn/{record}.csv"])
    row = real_benches.examined(bench)
    assert row["exit"] == real_tables.REFUSED
    assert "not used for identification" in row["said"]
