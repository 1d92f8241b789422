"""`ema records check` on records with a mistake of a known kind, and on sound ones."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner
from plain_axis import RATE, bench

from ema.cli import cli
from ema.core.csv_records import write_csv
from ema.core.errors import ConfigError, NegativeAnswer
from ema.core.records import Cycle, Record
from ema.discrepancy.records import channels


def asked(record, tmp_path, *options):
    path = tmp_path / "bench.csv"
    write_csv(record, path)
    done = CliRunner().invoke(cli, ["records", "check", str(path), "--json", *options], catch_exceptions=False)
    return json.loads(done.stdout)[0]


def facts_of(record):
    return {one.name: one for one in channels(record)}


def agreement(answer, what):
    (one,) = [one for one in answer["agreements"] if one["what"].startswith(what)]
    return one


def test_a_sound_record_has_nothing_in_the_way(tmp_path):
    answer = asked(bench(), tmp_path)
    assert answer["obstacles"] == []
    assert list(answer["plants"]) == ["axis"]
    assert "i_a [A]" in answer["missing"]["ema"]
    assert answer["sampling"]["period"] == pytest.approx(1.0 / RATE)
    noise = {one["name"]: one["noise"] for one in answer["channels"]}
    assert noise["w_m"] == pytest.approx(0.02, rel=0.2)
    assert noise["i_q"] == pytest.approx(0.002, rel=0.3)


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (30.0 / np.pi, "rpm taken for rad/s"),
        (1.0 / (2.0 * np.pi), "radians taken for turns"),
        (180.0 / np.pi, "degrees taken for radians"),
        (1e-3, "units taken for milli-units"),
    ],
)
def test_a_wrong_unit_is_told_by_its_factor(factor, words, tmp_path):
    one = agreement(asked(bench(w_m=lambda w: factor * w), tmp_path), "w_m against dtheta_m/dt")
    assert not one["is_fine"]
    assert words in one["said"]


def test_a_wrong_sign_is_told(tmp_path):
    answer = asked(bench(w_m=np.negative, i_q=np.negative), tmp_path)
    assert "opposite sign" in agreement(answer, "w_m against dtheta_m/dt")["said"]
    assert agreement(answer, "i_q against the acceleration by w_m")["is_fine"]


def test_a_drive_that_brakes_is_told(tmp_path):
    answer = asked(bench(i_q=np.negative), tmp_path)
    assert not agreement(answer, "i_q against the acceleration by w_m")["is_fine"]


def test_clipping_quantisation_gaps_and_a_dead_channel_are_told(tmp_path):
    record = bench(w_m=lambda w: np.clip(w, -15.0, 15.0), i_q=lambda i: 0.2 * np.round(i / 0.2))
    (cycle,) = record.cycles
    kept = np.r_[0:1500, 1600:3000, 3001:4000]
    channels = {name: x[kept] for name, x in cycle.channels.items()} | {"u_dc": np.full(len(kept), 48.0)}
    answer = asked(Record((Cycle(0, channels),)), tmp_path)
    facts = {one["name"]: one for one in answer["channels"]}
    assert facts["w_m"]["held"] > 0.2
    assert facts["i_q"]["step"] == pytest.approx(0.2)
    assert facts["u_dc"]["is_constant"]
    assert answer["sampling"]["n_gaps"] == 2
    said = " ".join(answer["obstacles"])
    for words in ("w_m is held at an end", "2 gaps", "u_dc is constant", "i_q has only"):
        assert words in said


def test_a_drive_that_is_sampled_too_slowly_is_told(tmp_path):
    rng = np.random.default_rng(3)
    answer = asked(bench(i_q=lambda i: np.where(rng.random(len(i)) < 0.5, -1.0, 1.0) + 1e-6 * i), tmp_path)
    assert any("sampled too slowly" in one for one in answer["obstacles"])


def test_jitter_is_told_and_does_not_bend_the_comparison(tmp_path):
    (cycle,) = bench().cycles
    rng = np.random.default_rng(5)
    t = cycle["t"] + rng.uniform(-0.4, 0.4, cycle.n_samples) / RATE
    channels = {"t": t, **{n: np.interp(t, cycle["t"], cycle[n]) for n in ("theta_m", "w_m", "i_q")}}
    answer = asked(Record((Cycle(0, channels),)), tmp_path)
    assert any("vary by" in one for one in answer["obstacles"])
    assert agreement(answer, "w_m against dtheta_m/dt")["is_fine"]


def test_a_record_for_no_plant_is_a_negative_answer(tmp_path):
    (tmp_path / "x.csv").write_text("t [s],temp_w [degC]\n" + "\n".join(f"{n},{20 + n}" for n in range(20)))
    done = CliRunner().invoke(cli, ["records", "check", str(tmp_path / "x.csv")])
    assert done.exit_code == 1
    assert "enough for no plant" in str(done.exception)
    assert "a position or a speed" in done.stdout


def test_a_reference_is_enough_where_a_position_loop_makes_the_drive(tmp_path):
    rows = "\n".join(f"{0.01 * n},{np.sin(0.05 * n)},{np.sin(0.05 * n - 0.1)}" for n in range(600))
    (tmp_path / "x.csv").write_text(f"t [s],theta_ref [rad],theta_m [rad]\n{rows}")
    done = CliRunner().invoke(cli, ["records", "check", str(tmp_path / "x.csv")])
    assert done.exit_code == 0
    assert "position_loop" in done.stdout
    begun = CliRunner().invoke(cli, ["plant", "init", str(tmp_path / "x.csv"), "--out", str(tmp_path / "plant.yaml")])
    assert begun.exit_code != 0
    assert "position_loop that makes it from theta_ref" in str(begun.exception)


def test_an_actuator_s_record_tells_its_gear_and_its_star(hidden, tmp_path):
    cycles = hidden.cycles(hidden.Flaws(), 1, 1, motions=(hidden.chirp(),))
    record = Record(tuple(Cycle(n, channels) for n, channels in enumerate(cycles)))
    answer = asked(record, tmp_path, "--picture", str(tmp_path / "p.svg"))
    assert "ema" in answer["plants"]
    assert agreement(answer, "theta_m against theta_u")["slope"] == pytest.approx(500.0, rel=0.01)
    assert agreement(answer, "i_a + i_b + i_c")["is_fine"]
    assert (tmp_path / "p.svg").stat().st_size > 10_000


def test_the_turns_of_a_coarse_encoder_are_no_limit(tmp_path):
    """A sine in steps of an encoder rests at its turns for several samples; one that a stop cuts rests as abruptly."""
    record = bench()
    t = record.cycles[0]["t"]
    turning = 2.0 * np.pi / 4096 * np.round(np.sin(2.0 * np.pi * t / t[-1] * 7.0) * 4096 / (2.0 * np.pi))
    for motion, is_held in ((turning, False), (np.clip(turning, None, 0.9), True)):
        cycle = Cycle(0, {**record.cycles[0].channels, "theta_m": motion})
        assert (facts_of(Record((cycle,)))["theta_m"].held > 0.0) is is_held


@pytest.mark.parametrize(
    ("plant", "raised", "words"),
    [
        ("kind: axis\nmotion: linear\nM: 2\nF_d: 1\ndrive: force\n", NegativeAnswer, "enough for no search by"),
        ("kind: axis\nJ: heavy\nF_d: 1\n", ConfigError, "'J' = 'heavy'"),
        ("kind: axle\n", ConfigError, "must be one of ema, axis"),
    ],
)
def test_a_record_is_held_against_its_plant_file(plant, raised, words, tmp_path):
    write_csv(bench(), tmp_path / "x.csv")
    (tmp_path / "plant.yaml").write_text(plant)
    words_of = ["records", "check", str(tmp_path / "x.csv"), "--plant", str(tmp_path / "plant.yaml")]
    with pytest.raises(raised, match=words):
        CliRunner().invoke(cli, words_of, catch_exceptions=False)
