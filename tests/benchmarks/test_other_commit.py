"""Trials given to another commit: as files, by its own command, its answer laid beside the truth."""

from __future__ import annotations

import json
import subprocess

import pytest
from click.testing import CliRunner

from benchmarks import frozen, other_commit, strata, strata_axis
from ema.models import actuator_file

ROW = {"commit": "a" * 40, "outcome": "refused", "stratum": "one effect", "number": 0, "seed": 3}


@pytest.fixture(scope="module")
def truth():
    """The trial of ROW."""
    return strata_axis.drawn("one effect", 0, 3)


@pytest.fixture
def checkout(tmp_path, truth):
    """A commit whose finder names viscous drag where the inertia in the plant file is what it was told."""
    folder = tmp_path / "old"
    (folder / ".venv/bin").mkdir(parents=True)
    J = float(truth.plant_file.get("J", truth.plant_file.get("m", 0.0)))
    command = folder / ".venv/bin/ema"
    command.write_text(
        f"""#!/usr/bin/env python3
import json, pathlib, sys
words = sys.argv[1:]
plant = json.loads(pathlib.Path(words[words.index("--plant") + 1]).read_text())
record = pathlib.Path(words[1]).read_text().splitlines()
assert words[0] == "discrepancy" and len(record) > 100 and "[" in record[0]
if plant.get("J", plant.get("m")) != {J!r}:
    sys.exit("another plant")
out = pathlib.Path(words[words.index("--out") + 1])
out.mkdir()
effect = {{"name": "viscous_drag", "indistinguishable_from": [], "confidence": 0.9, "parameters": {{}}}}
heldout = {{"err_before": 1.0, "err_after": 0.1, "noise_floor": 0.1}}
said = {{"verdict": "explained", "effects": [effect], "structure": {{}}, "gain": {{"heldout": heldout}}}}
(out / "findings.json").write_text(json.dumps(said))
""",
        encoding="utf-8",
    )
    command.chmod(0o755)
    git = ["git", "-c", "user.name=n", "-c", "user.email=e", "-C", str(folder)]
    for words in (["init", "-q"], ["commit", "-q", "--allow-empty", "-m", "one"]):
        subprocess.run([*git, *words], check=True)
    return folder


def test_what_the_other_commit_says_stands_beside_what_was_hidden(tmp_path, checkout, truth):
    rows, out = tmp_path / "rows.jsonl", tmp_path / "out.jsonl"
    rows.write_text(json.dumps(ROW) + "\n", encoding="utf-8")
    for _ in range(2):  # what is there is not done again
        told = CliRunner().invoke(other_commit.main, [str(rows), "--checkout", str(checkout), "--out", str(out)])
        assert told.exit_code == 0, told.output
    (row,) = frozen.read_rows(out)
    assert row["commit"] == frozen.commit(checkout) != ROW["commit"]
    assert row["effects"] == list(truth.effects)
    assert row["hidden"] == truth.truth
    assert row["named"] == [["viscous_drag"]]
    assert row["outcome"] == ("right" if truth.effects == ("viscous_drag",) else "wrong")


@pytest.mark.parametrize(("status", "outcome"), [(2, "refused"), (1, "crashed")])
def test_no_answer_is_a_refusal_where_it_says_so_and_else_a_crash(tmp_path, checkout, status, outcome):
    command = checkout / ".venv/bin/ema"
    command.write_text(f"#!/bin/sh\necho 'no such plant' >&2\nexit {status}\n", encoding="utf-8")
    rows, out = tmp_path / "rows.jsonl", tmp_path / "out.jsonl"
    rows.write_text(json.dumps(ROW) + "\n", encoding="utf-8")
    CliRunner().invoke(other_commit.main, [str(rows), "--checkout", str(checkout), "--out", str(out)])
    (row,) = frozen.read_rows(out)
    assert row["outcome"] == outcome
    assert row["said"] == ["no such plant"]


def test_the_plant_file_of_a_trial_is_the_plant_of_the_trial(tmp_path):
    row = {"commit": "a" * 40, "stratum": "nothing", "number": 0, "seed": 7, "k": [0.0] * 6}
    _, file, _, _ = other_commit.as_given(row)
    path = tmp_path / "plant.yaml"
    path.write_text(json.dumps(file), encoding="utf-8")
    assert actuator_file.load(path) == strata.drawn("nothing", 0, 7).actuator
