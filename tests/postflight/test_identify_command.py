"""`ema identify` as a contract: records in, faults out; what is not the bundle's test is refused in one line."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner
from ema_postflight.identify_command import identify

from ema.core.csv_records import write_csv
from ema.core.errors import RecordError
from ema.core.records import Cycle, Record
from ema.models import hf

K = np.array([0.05, 0.02, 0.04, 0.0, 0.03, 0.02])


@pytest.fixture(scope="module")
def cycle(shipped_plant):
    r = hf.simulate(shipped_plant, K, seeds=99)
    return {
        "t": r.t,
        **{f"i_{phase}": r.i[0, j] for j, phase in enumerate("abc")},
        "theta_m": r.theta_m[0],
        "theta_u": r.theta_u[0],
        "theta_cmd": shipped_plant.command(),
        "u_dc": r.u_dc[0],
    }


def run(bundle, path, *more):
    return CliRunner().invoke(
        identify, ["--bundle", str(bundle.path), *more, str(path)], catch_exceptions=False, standalone_mode=False
    )


def written(tmp_path, *cycles):
    path = tmp_path / "record.csv"
    write_csv(Record(tuple(Cycle(n, c) for n, c in enumerate(cycles))), path)
    return path


@pytest.mark.parametrize("method", ["linear", "lf2", "lf1", "hf"])
def test_every_method_finds_small_faults(coarse_bundle, cycle, tmp_path, method):
    result = run(coarse_bundle, written(tmp_path, cycle, cycle), "--method", method, "--json")
    answer = json.loads(result.stdout)
    assert answer["method"] == method
    first, second = answer["records"][0]["cycles"]
    assert {**first, "cycle": 1} == second, "the same cycle, the same answer"
    assert np.linalg.norm(np.array(first["k"]) - K) / 6**0.5 < 0.02
    low, high = np.array(first["intervals"]["0.95"]).T
    assert ((low >= 0) & (low <= high) & (high <= 1)).all()
    assert answer["records"][0]["missing_channels"] == []


def test_a_record_given_twice_is_refused(coarse_bundle, cycle, tmp_path):
    path = written(tmp_path, cycle)
    (tmp_path / "same.csv").symlink_to(path)
    for again in (path, tmp_path / "." / "record.csv", tmp_path / "same.csv"):
        with pytest.raises(RecordError, match="is given twice"):
            run(coarse_bundle, path, str(again))


def test_missing_channels_are_said_and_widen_the_answer(coarse_bundle, cycle, tmp_path):
    bare = {name: x for name, x in cycle.items() if name in ("t", "i_a", "i_b", "i_c")}
    answer = json.loads(run(coarse_bundle, written(tmp_path, bare), "--json").stdout)["records"][0]
    assert answer["missing_channels"] == ["theta_u", "theta_m", "theta_cmd", "u_dc"]
    assert "start_state_unknown" in answer["cycles"][0]["reasons"]
    assert "not measured: theta_u" in run(coarse_bundle, tmp_path / "record.csv").stdout


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda c: {n: x[:3000] for n, x in c.items()}, "3000 samples"),
        (lambda c: {**c, "t": 2 * c["t"]}, "sampled every 0.0002 s"),
        (lambda c: {n: x for n, x in c.items() if n != "i_b"}, "missing channel i_b"),
        (lambda c: {**c, "u_dc": 0 * c["t"] + 320.0}, "bus voltage 320 V"),
        (lambda c: {**c, "theta_cmd": -c["theta_cmd"]}, "not the test motion"),
        (lambda c: {**c, "i_a": 100 * c["i_a"]}, "currents reach"),
        (lambda c: {**c, "i_a": 0 * c["t"]}, "constant"),
    ],
)
def test_a_record_of_something_else_is_refused(coarse_bundle, cycle, tmp_path, change, says):
    with pytest.raises(RecordError, match=says) as error:
        run(coarse_bundle, written(tmp_path, change(cycle)))
    assert "\n" not in str(error.value)


def test_a_cycle_of_another_motion_is_said_and_the_others_are_identified(coarse_bundle, cycle, tmp_path):
    path = written(tmp_path, cycle, {**cycle, "theta_cmd": -cycle["theta_cmd"]})
    good, other = json.loads(run(coarse_bundle, path, "--json").stdout)["records"][0]["cycles"]
    assert good["status"] == "valid"
    assert other["status"] == "not_estimated"
    assert "cycle 1: theta_cmd is not the test motion" in other["refused"]
    assert "not estimated: " in run(coarse_bundle, path).stdout


def test_a_recorder_that_ends_one_sample_early_costs_nothing(coarse_bundle, cycle, tmp_path):
    path = written(tmp_path, {name: x[:5000] for name, x in cycle.items()}, cycle)
    short, whole = json.loads(run(coarse_bundle, path, "--json").stdout)["records"][0]["cycles"]
    assert np.abs(np.array(short["k"]) - whole["k"]).max() < 0.2 * max(whole["sd"])
