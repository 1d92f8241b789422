"""A frozen run is of one commit, on seeds that follow from it, and its plants are what the finder is told."""

from __future__ import annotations

import json
from itertools import combinations

import numpy as np
import pytest
from click.testing import CliRunner

from benchmarks import frozen, frozen_table, strata
from ema.models import hf

HEAD = "a" * 40


def test_seeds_follow_from_the_commit_and_the_trial():
    assert frozen.seed(HEAD, "nothing", 3) == frozen.seed(HEAD, "nothing", 3)
    drawn = {frozen.seed(c, s, n) for c in (HEAD, "b" * 40) for s in strata.STRATA for n in range(50)}
    assert len(drawn) == 2 * len(strata.STRATA) * 50


@pytest.mark.parametrize(
    ("commits", "says"),
    [([HEAD, "b" * 40], "2 commits"), ([HEAD + "+"], "commit first"), ([None], "cannot be repeated")],
)
def test_rows_of_several_commits_or_of_a_changed_tree_make_no_table(commits, says):
    with pytest.raises(frozen_table.MixedCommitsError, match=says):
        frozen_table.table([{"commit": c} for c in commits])


def test_a_file_of_another_commit_is_refused_before_anything_is_run(tmp_path):
    out = tmp_path / "rows.jsonl"
    out.write_text(json.dumps({"commit": HEAD, "stratum": "nothing", "number": 0}) + "\n")
    run = CliRunner().invoke(frozen.main, ["--out", str(out), "--trials", "1"])
    assert run.exit_code == 1
    assert "must be of one" in run.output or "commit first" in run.output
    assert len(out.read_text().splitlines()) == 1


def test_an_unfinished_run_goes_on_where_it_ended():
    of = strata.counts(60)
    whole = list(frozen.missing(of, []))
    assert len(whole) == sum(of.values())
    done = [{"stratum": s, "number": n} for s, n in whole[:17]]
    assert list(frozen.missing(of, done)) == whole[17:]


def test_every_effect_and_every_kind_outside_the_library_has_its_turn():
    n = strata.counts(300)
    cases = {strata.drawn(s, j, frozen.seed(HEAD, s, j)).case for s in ("one effect", "recorder") for j in range(n[s])}
    assert cases >= set(strata.EFFECTS)
    assert cases >= set(strata.RECORDER)


def test_plants_differ_by_more_than_a_factor_of_two(support):
    plants = support("hidden_actuator").PLANTS.values()
    for a, b in combinations(plants, 2):
        for name in ("J", "F_d", "L", "GR"):
            x, y = getattr(a, name), getattr(b, name)
            assert max(x, y) / min(x, y) > 2.0, name


@pytest.mark.parametrize("name", ["shipped", "heavy", "light"])
def test_the_finder_is_told_the_plant_that_the_second_simulator_has(support, name):
    """Both simulators move alike, to a few per cent of the motion and of the current."""
    hidden = support("hidden_actuator")
    nominal = hidden.PLANTS[name]
    command = 500.0 / nominal.GR * hidden.chirp()
    plant = strata.as_actuator(nominal)
    bench = hidden.Bench(nominal=nominal)
    theirs = hidden.cycle(hidden.Flaws(), command, hidden.rest(nominal=nominal), 3, bench)
    ours = hf.simulate(plant, np.zeros(6), command, seeds=5)
    assert np.abs(theirs["theta_u"] - ours.theta_u[0]).max() < 0.03 * np.ptp(command)
    i = np.abs([theirs[f"i_{j}"] for j in "abc"]).sum(axis=0)
    assert np.mean(i) == pytest.approx(np.mean(np.abs(ours.i[0]).sum(axis=0)), rel=0.02)
