"""The table of a frozen run says what its rows say, and the page shows it as it is rendered."""

from __future__ import annotations

import json
import re

import hidden_actuator
import hidden_cases
import numpy as np
import pytest
from click.testing import CliRunner

from benchmarks import frozen, frozen_table, other_commit

HEAD = "a" * 40
ROOT = frozen.ROOT
PAGE = ROOT / "docs" / "discrepancy-trials.md"
BLOCK = re.compile(r"<!-- frozen (.+?) -->\n(.*?)\n<!-- end -->", re.S)


def row(number=0, **changed):
    """A row of a trial in which a spring was hidden and found."""
    plain = {
        "commit": HEAD, "stratum": "one effect", "number": number, "case": "spring_load", "effects": ["spring_load"],
        "outcome": "right", "verdict": "explained", "visible": None, "named": [["spring_load"]], "confidence": [0.97],
        "z": {"spring_load.stiffness": 0.3}, "err_before": 0.1, "err_after": 0.01, "noise_floor": 0.01,
        "k": [0.0] * 6, "k_after": [0.0] * 6, "cpu_s": 30.0,
    }  # fmt: skip
    return {**plain, **changed}


def cells(text, what):
    """The row of a table that begins with `what`."""
    (line,) = (line for line in text.splitlines() if line.startswith(f"| {what}"))
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_probabilities_that_are_true_lie_within_the_intervals_of_their_bins():
    rng = np.random.default_rng(24)
    print("seed 24")
    p = rng.random(4000)
    for _, stated, right in frozen_table.reliability([(x, bool(rng.random() < x)) for x in p]):
        low, high = (float(x) for x in re.findall(r"([\d.]+)%", right))
        assert low - 1.0 <= 100.0 * float(stated) <= high + 1.0


def test_one_bit_of_confidence_shows_as_one_bin_and_as_too_sure():
    answers = [(0.99, j % 4 > 0) for j in range(100)]
    rows = frozen_table.reliability(answers)
    assert [right for _, _, right in rows[:3]] == ["none"] * 3
    assert rows[3][2].startswith("75 of 100")


def test_intervals_are_counted_at_three_levels():
    z = np.random.default_rng(3).standard_normal(4000)
    for p, (_, share) in zip((0.5, 0.9, 0.95), frozen_table.coverage(z.tolist()), strict=True):
        count, n = map(int, re.match(r"(\d+) of (\d+)", share).groups())
        assert count / n == pytest.approx(p, abs=0.03)


def test_a_set_is_as_sure_as_it_says_not_as_its_first_member_times_its_members():
    """A set of two with 0.61 and 0.1 had counted as sure of 1."""
    unsure = row(1, named=[["cogging", "resolver_error"]], confidence=[0.61], of_set=[0.71])
    assert cells(frozen_table.table([row(0), unsure]), "confidently wrong")[1].startswith("0 of 2")
    before = {name: x for name, x in unsure.items() if name != "of_set"}
    assert cells(frozen_table.table([row(0), before]), "confidently wrong")[1].startswith("1 of 2")


def test_an_effect_that_is_not_there_beside_one_that_is_counts_as_confidently_wrong():
    extra = row(1, named=[["spring_load"], ["cogging"]], confidence=[0.97, 0.95])
    text = frozen_table.table([row(), extra])
    assert cells(text, "confidently wrong")[1].startswith("1 of 2")


def test_what_cannot_be_seen_is_not_missed_and_what_can_is():
    hidden = {"outcome": "missed", "verdict": "adequate", "named": [], "confidence": [], "z": {}}
    text = frozen_table.table([row(), row(1, visible=1.05, **hidden), row(2, visible=3.0, **hidden)])
    assert cells(text, "named, or in a set that holds")[1].startswith("1 of 2")
    assert cells(text, "hidden and not to be seen")[1] == "1 of 3"


def test_what_is_missed_of_a_pair_is_judged_by_itself():
    """A magnet is plain to see; that of a sag of a milliohm is not, whatever stands beside it."""
    name, flaws = "magnet_flux + supply_sag", hidden_actuator.Flaws(flux=-0.06, source_resistance=1e-3)
    findings = {"effects": [{"name": "magnet_flux", "indistinguishable_from": ["k4 and k5 alike"]}]}
    assert hidden_cases.unseen(name, findings) == ["supply_sag"]
    assert hidden_cases.unseen(name, {"effects": []}) == ["magnet_flux", "supply_sag"]
    bench = (1, 5, hidden_actuator.MOTIONS[:1], hidden_actuator.BENCH)
    magnet, sag = (
        hidden_cases.visibility(hidden_actuator, flaws, part, *bench) for part in ("magnet_flux", "supply_sag")
    )
    assert sag < 0.1 * magnet
    missed = {"outcome": "missed", "verdict": "explained", "effects": ["magnet_flux", "supply_sag"]}
    text = frozen_table.table([row(), row(1, visible=1.1, **missed), row(2, visible=1.3, **missed)])
    assert cells(text, "hidden and not to be seen")[1] == "1 of 3"


def test_what_the_truth_itself_could_not_show_is_not_missed_whatever_else_is_left():
    missed = {"outcome": "missed", "verdict": "partly explained", "effects": ["cogging", "supply_sag"]}
    text = frozen_table.table([row(), row(1, nats=3.0, **missed), row(2, nats=30.0, **missed)])
    assert cells(text, "hidden and not to be seen")[1] == "1 of 3"


def test_a_fault_that_is_not_there_and_an_explanation_that_leaves_much_are_counted():
    bad = row(1, k_after=[0.0, 0.0, 0.02, 0.0, 0.0, 0.0], err_after=0.013)
    text = frozen_table.table([row(), bad])
    assert cells(text, "trials with a fault")[1].startswith("1 of 2")
    assert cells(text, "explained with more")[1].startswith("1 of 2")


def test_a_fault_whose_interval_holds_nothing_is_not_told_and_intervals_of_faults_count():
    k = [0.0, 0.0, 0.02, 0.0, 0.0, 0.0]
    unsure, sure = ([[0.0, 0.0], [0.0, 0.0], [low, 0.04], *[[0.0, 0.0]] * 3] for low in (0.0, 0.001))
    rows = [row(), row(1, k_after=k, k_interval=unsure), row(2, k_after=k, k_interval=sure, z_k={"k4": 5.0})]
    text = frozen_table.table(rows)
    assert cells(text, "trials with a fault")[1].startswith("1 of 3")
    assert cells(text, "intervals of 95%")[1].startswith(f"{len(rows)} of {len(rows) + 1}")


def test_the_first_set_of_the_posterior_has_a_diagram_of_its_own():
    first = {"effects": ["spring_load", "cogging"], "probability": 0.9}
    text = frozen_table.table([row(posterior=[first])])
    assert "The same of the first set of the posterior" in text
    assert cells(text.split("posterior")[1], "0.8 to 0.95")[2].startswith("0 of 1")
    assert "posterior" not in frozen_table.table([row(posterior=[first], verdict="unexplained")])


def test_rows_as_they_were_first_written_are_rendered():
    """They name their case only, and have no posterior."""
    old = {name: x for name, x in row(case="spring_load on a free user").items() if name != "effects"}
    assert cells(frozen_table.table([old]), "named, or in a set that holds")[1].startswith("1 of 1")


def test_a_file_is_rendered_without_a_run_and_mixed_commits_are_refused(tmp_path):
    good, mixed = tmp_path / "good.jsonl", tmp_path / "mixed.jsonl"
    good.write_text(json.dumps(row()) + "\n")
    mixed.write_text(json.dumps(row()) + "\n" + json.dumps(row(commit="b" * 40)) + "\n")
    done = CliRunner().invoke(frozen.main, ["--render", str(good)])
    assert done.exit_code == 0
    assert "1 trials" in done.output
    refused = CliRunner().invoke(frozen.main, ["--render", str(mixed)])
    assert refused.exit_code == 1
    assert "must be of one" in refused.output


def test_a_page_without_the_block_is_refused_and_left_as_it_was(tmp_path):
    rows, page = tmp_path / "rows.jsonl", tmp_path / "page.md"
    rows.write_text(json.dumps(row()) + "\n")
    page.write_text("nothing here")
    assert CliRunner().invoke(frozen.main, ["--render", str(rows), "--into", str(page)]).exit_code == 1
    assert page.read_text() == "nothing here"
    page.write_text("before <!-- frozen rows.jsonl -->\nold\n<!-- end --> after")
    assert CliRunner().invoke(frozen.main, ["--render", str(rows), "--into", str(page)]).exit_code == 0
    assert page.read_text().startswith("before <!-- frozen rows.jsonl -->\nCommit")
    assert page.read_text().endswith("<!-- end --> after")


def test_the_page_shows_the_tables_of_the_rows_that_are_kept():
    blocks = BLOCK.findall(PAGE.read_text(encoding="utf-8"))
    assert blocks
    for name, text in blocks:
        first, *other = (ROOT / "benchmarks" / "trials" / file for file in name.split(" beside "))
        several = [ROOT / "benchmarks" / "trials" / file for file in name.split()]
        assert text == (other_commit.render(first, *other, None) if other else frozen.render(several, None))


def test_a_run_is_one_line_of_the_history():
    runs = [[row(), row(1, outcome="missed", nats=30.0)], [row(commit="b" * 40)]]
    _, _, first, second = frozen_table.history(runs).splitlines()
    assert [cell.strip() for cell in first.strip("|").split("|")][:3] == [f"`{HEAD[:9]}`", "2", "1 of 2"]
    assert second.split("|")[3].strip() == "1 of 1"


def test_two_commits_stand_beside_each_other_on_the_trials_that_both_have():
    new = [row(number=n, seed=n) for n in range(3)]
    old = [row(number=n, seed=n, commit="b" * 40, outcome="missed" if n else "right") for n in (0, 1, 5)]
    text = frozen_table.beside(new, old)
    assert text.startswith("The 2 trials that")
    _, before, now = cells(text, "named, or in a set that holds the truth")
    assert (before.split(" (")[0], now.split(" (")[0]) == ("1 of 2", "2 of 2")
    with pytest.raises(frozen_table.MixedCommitsError):
        frozen_table.beside(new, [*old, {**old[0], "commit": "c" * 40}])


def test_what_the_recorder_made_may_be_named_beside_what_is_hidden():
    def told(*names, verdict="explained"):
        return {"verdict": verdict, "effects": [{"name": n, "indistinguishable_from": []} for n in names]}

    made = ("adc_saturation",)
    assert hidden_cases.outcome("load_friction", told("load_friction", *made), made) == "right"
    assert hidden_cases.outcome("load_friction", told("load_friction", *made)) == "wrong"
    assert hidden_cases.outcome("load_friction", told(*made), made) == "missed"
    assert hidden_cases.outcome("none", told(*made), made) == "right"
    assert hidden_cases.outcome("none", told("inertia", *made), made) == "wrong"
