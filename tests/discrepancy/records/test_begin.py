"""`ema plant init`: a file that the other commands accept, with what the records show in it."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner
from plain_axis import F_D, K_T, RATE, C, J, bench

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
    assert (plant.k_t, plant.p, plant.fitted) == (K_T, 7, ("J", "C"))
    text = path.read_text()
    assert "fitted to the records" in text
    assert "data sheet" in text


def test_stamps_that_jitter_are_said_in_the_file_that_they_spoil(tmp_path):
    """Stamps off by a seventh of the period had an inertia of 6e-4 fitted as 4.4e-4."""
    record = bench()
    rng = np.random.default_rng(3)
    late = [c["t"] + 0.15 / RATE * rng.standard_normal(c.n_samples) for c in record]
    shaken = Record(tuple(Cycle(c.number, {**c.channels, "t": t}) for c, t in zip(record, late, strict=True)))
    assert "time stamps jitter" not in init(record, tmp_path, "--k-t", str(K_T)).read_text()
    (tmp_path / "shaken").mkdir()
    text = init(shaken, tmp_path / "shaken", "--k-t", str(K_T)).read_text()
    (line,) = [line for line in text.splitlines() if "time stamps jitter" in line]
    assert line.startswith("#")
    assert "give them even times" in line


def test_what_nobody_said_is_marked_as_a_guess(tmp_path):
    text = init(bench(), tmp_path).read_text()
    (line,) = [line for line in text.splitlines() if line.startswith("k_t")]
    assert "a guess" in line


def test_a_neighbour_that_was_recorded_is_declared_and_marked_as_a_guess(tmp_path):
    record = bench()
    cycles = [Cycle(c.number, {**c.channels, "theta_n": np.sin(c["t"])}) for c in record.cycles]
    path = init(Record(tuple(cycles)), tmp_path, "--k-t", str(K_T))
    assert axis_config.load(path).neighbour == "inner"
    (line,) = [line for line in path.read_text().splitlines() if line.startswith("neighbour")]
    assert "a guess: outer where" in line


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


def cogging_bench(order=12.0, size=0.02, seed=1):
    """A slow motion in which cogging takes twice as much as friction, and the axis swings over it."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 12.0, 1.0 / RATE)
    w = np.where(t < 6.0, 2.0, -2.0) * (1.0 + 0.6 * np.sin(order * 2.0 * t)) + 0.2 * np.sin(2.9 * t)
    theta = np.cumsum(w) / RATE
    tau = J * np.gradient(w, t) + C * w + F_D * np.sign(w) + size * np.sin(order * theta + 0.5)
    channels = {"t": t, "theta_m": theta + 2e-5 * rng.standard_normal(len(t)), "i_q": tau / K_T}
    channels["i_q"] = channels["i_q"] + 0.01 * rng.standard_normal(len(t))
    return Record((Cycle(0, channels),))


def test_cogging_is_not_taken_for_dry_friction(tmp_path):
    path = init(cogging_bench(), tmp_path, "--k-t", str(K_T))
    plant = axis_config.load(path)
    assert pytest.approx(F_D, rel=0.15) == plant.F_d
    assert pytest.approx(J, rel=0.15) == plant.J
    assert "order 12" in path.read_text()


def test_one_speed_shows_neither_inertia_nor_drag(tmp_path):
    t = np.arange(0.0, 20.0, 0.01)
    w = np.where(t < 10.0, 0.3, -0.3)
    theta = np.cumsum(w) * 0.01
    tau = F_D * np.sign(w) + 2e-4 * np.random.default_rng(1).standard_normal(len(t))
    path = init(Record((Cycle(0, {"t": t, "theta_m": theta, "torque": tau}),)), tmp_path)
    plant = axis_config.load(path)
    assert pytest.approx(F_D, rel=0.05) == plant.F_d
    assert plant.C == 0.0
    lines = path.read_text().splitlines()
    assert all("a guess" in line for line in lines if line.startswith(("J:", "C:")))


@pytest.mark.parametrize("beside", [(), ("i_q",)])
@pytest.mark.parametrize("channel", ["u_q", "duty"])
def test_a_voltage_or_a_duty_cycle_drives(channel, beside, tmp_path):
    R, supply = 0.8, 24.0
    cycle = bench().cycles[0]
    u = R * cycle["i_q"] + K_T * cycle["w_m"]
    whole, said = (supply, ("--supply", str(supply))) if channel == "duty" else (1.0, ())
    channels = {name: cycle[name] for name in ("t", "theta_m", "w_m", *beside)} | {channel: u / whole}
    options = ("--k-t", str(K_T), "--R", f"{1e3 * R:g}mohm", "--brushed", *said)
    options += ("--drive", channel) if beside else ()
    plant = axis_config.load(init(Record((Cycle(0, channels),)), tmp_path, *options))
    assert plant.drive == "voltage"
    assert plant.k_e == plant.k_t == K_T
    assert pytest.approx(J, rel=0.05) == plant.J
    assert pytest.approx(F_D, rel=0.3) == plant.F_d


def test_where_a_torque_behind_a_gear_was_measured_is_asked_for(tmp_path):
    (cycle,) = bench().cycles
    channels = {name: x for name, x in cycle.channels.items() if name != "i_q"} | {"torque": 50.0 * K_T * cycle["i_q"]}
    record = Record((Cycle(0, channels),))
    guessed = init(record, tmp_path, "--gear", "50").read_text()
    assert "give --torque-at load" in guessed
    (tmp_path / "plant.yaml").unlink()
    (tmp_path / "bench.csv").unlink()
    said = axis_config.load(init(record, tmp_path, "--gear", "50", "--torque-at", "load"))
    assert (said.torque_at, said.measured_at) == ("load", "motor")
    assert pytest.approx(J, rel=0.05) == said.J


def test_constants_of_the_motor_are_those_at_the_load_where_the_motion_was_measured_there(tmp_path):
    """N times k_t and k_e, and so N^2 times the inertia: a servo tells the angle of its horn."""
    N, R = 20.0, 0.8
    (cycle,) = bench().cycles
    channels = {"t": cycle["t"], "theta_m": cycle["theta_m"] / N, "w_m": cycle["w_m"] / N}
    channels["u_q"] = R * cycle["i_q"] + K_T * cycle["w_m"]
    options = ("--k-t", str(K_T), "--R", str(R), "--brushed", "--gear", str(N), "--measured-at", "load")
    plant = axis_config.load(init(Record((Cycle(0, channels),)), tmp_path, *options))
    assert plant.k_e == plant.k_t == pytest.approx(N * K_T)
    assert pytest.approx(N**2 * J, rel=0.05) == plant.J
    assert pytest.approx(N * F_D, rel=0.3) == plant.F_d
    assert pytest.approx(N**2 * C, rel=0.3) == plant.C


def test_a_load_cell_beside_a_current_is_no_drive_and_its_load_no_friction(tmp_path):
    (cycle,) = bench().cycles
    load = 0.8 * np.sin(2.0 * np.pi * 0.37 * cycle["t"])
    channels = {**cycle.channels, "i_q": cycle["i_q"] + load / K_T, "load_torque": load}
    plant = axis_config.load(init(Record((Cycle(0, channels),)), tmp_path, "--k-t", str(K_T)))
    assert plant.drive == "current"
    assert pytest.approx(J, rel=0.05) == plant.J
    assert pytest.approx(F_D, rel=0.2) == plant.F_d


def speed_loop_bench(gain=0.5):
    """The bench driven by a speed loop: what it was commanded, by the current that flowed."""
    cycle = bench().cycles[0]
    return Record((Cycle(0, {"t": cycle["t"], "w_m": cycle["w_m"], "w_ref": cycle["w_m"] + cycle["i_q"] / gain}),))


def test_a_speed_loop_drives(tmp_path):
    path = init(speed_loop_bench(), tmp_path, "--k-t", str(K_T), "--K-w", "0.5")
    plant = axis_config.load(path)
    assert plant.drive == "speed-loop"
    assert plant.loop.K_w == 0.5
    assert pytest.approx(J, rel=0.05) == plant.J
    assert pytest.approx(F_D, rel=0.2) == plant.F_d


def test_a_number_that_waits_for_another_says_so(tmp_path):
    text = init(speed_loop_bench(), tmp_path, "--k-t", str(K_T)).read_text()
    lines = {line.split(":")[0]: line for line in text.splitlines()}
    assert "give --K-w" in lines["loop"]
    assert all("a guess: the records may show it with --K-w" in lines[key] for key in ("J", "C", "F_d"))


@pytest.mark.parametrize("said", ["voltage", "u_q"])
def test_a_drive_is_said_by_its_channel_or_its_kind(said, tmp_path):
    cycle = bench().cycles[0]
    channels = {**cycle.channels, "u_q": cycle["i_q"] + K_T * cycle["w_m"]}
    options = ("--k-t", str(K_T), "--R", "1", "--brushed", "--drive", said, "--slots", "24")
    plant = axis_config.load(init(Record((Cycle(0, channels),)), tmp_path, *options))
    assert (plant.drive, plant.slots) == ("voltage", 24)
