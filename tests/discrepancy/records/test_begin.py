"""`ema plant init`: a file that the other commands accept, with what the records show in it."""

from __future__ import annotations

import pytest
from click.testing import CliRunner
from plain_axis import F_D, K_T, C, J, bench

from ema.cli import cli
from ema.core import config
from ema.core.csv_records import write_csv
from ema.core.records import Cycle, Record
from ema.models import axis_config
from ema.models.actuator import Actuator


def init(record, tmp_path, *options):
    write_csv(record, tmp_path / "bench.csv")
    words = ["plant", "init", str(tmp_path / "bench.csv"), "--out", str(tmp_path / "plant.yaml"), *options]
    done = CliRunner().invoke(cli, words, catch_exceptions=False)
    assert done.exit_code == 0
    return tmp_path / "plant.yaml"


def test_an_axis_gets_its_inertia_and_friction_from_the_record(tmp_path):
    path = init(bench(), tmp_path, "--k-t", str(K_T), "--pole-pairs", "7")
    plant = axis_config.load(path)
    assert pytest.approx(J, rel=0.05) == plant.J
    assert pytest.approx(C, rel=0.3) == plant.C
    assert pytest.approx(F_D, rel=0.2) == plant.F_d
    assert (plant.k_t, plant.p, plant.fitted) == (K_T, 7, ("J",))
    text = path.read_text()
    assert "fitted to the records" in text
    assert "data sheet" in text


def test_what_nobody_said_is_marked_as_a_guess(tmp_path):
    text = init(bench(), tmp_path).read_text()
    (line,) = [line for line in text.splitlines() if line.startswith("k_t")]
    assert "a guess" in line


def test_an_actuator_gets_its_gear_and_pole_pairs_from_the_record(hidden, tmp_path):
    cycles = hidden.cycles(hidden.Flaws(), 1, 1, motions=(hidden.chirp(),))
    path = init(Record(tuple(Cycle(n, channels) for n, channels in enumerate(cycles))), tmp_path)
    plant = config.load(path, Actuator)
    assert plant.motor.p == 2
    assert pytest.approx(500.0, rel=0.01) == plant.transmission.GR
    assert "slope of theta_m over theta_u" in path.read_text()


def test_nothing_is_overwritten_and_no_motion_is_told(tmp_path):
    path = init(bench(), tmp_path)
    again = CliRunner().invoke(cli, ["plant", "init", str(tmp_path / "bench.csv"), "--out", str(path)])
    assert "exists" in str(again.exception)
    (tmp_path / "x.csv").write_text("t [s],i_q [A]\n0,1\n1,2\n")
    none = CliRunner().invoke(cli, ["plant", "init", str(tmp_path / "x.csv"), "--out", str(tmp_path / "y.yaml")])
    assert "no motion" in str(none.exception)
    assert not (tmp_path / "y.yaml").exists()
