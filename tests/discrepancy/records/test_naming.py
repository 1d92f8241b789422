"""Titles as strangers write them, and what they are taken for."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

from ema.cli import cli
from ema.core.errors import ConfigError, NegativeAnswer, RecordError
from ema.core.records import read_record
from ema.discrepancy.axis.balance.records.of_records import balance
from ema.discrepancy.axis.balance.telling.telling import describe
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models import axis_config


def mapped(tmp_path, titles, units="", *options):
    """The answer of `ema records map` and the file, two rows of numbers."""
    n = len(titles.split(","))
    rows = [",".join(str(float(row + column)) for column in range(n)) for row in range(3)]
    path = tmp_path / "bench.csv"
    path.write_text("\n".join([titles, *([units] if units else []), *rows]) + "\n")
    return path, CliRunner().invoke(cli, ["records", "map", str(path), *options], catch_exceptions=False)


def channels(answer):
    columns = yaml.safe_load(answer.stdout)["columns"]
    return {title: one if one == "ignore" else (one["channel"], one["unit"]) for title, one in columns.items()}


@pytest.mark.parametrize(
    ("titles", "units", "wanted"),
    [
        (
            "timestamp,goal_deg,present_deg,pwm_percent,voltage", "",
            {
                "timestamp": ("t", "s"), "goal_deg": ("theta_ref", "deg"), "present_deg": ("theta_m", "deg"),
                "pwm_percent": ("duty", "%"), "voltage": ("u_dc", "V"),
            },
        ),
        (
            "t [s],angle [rad],current [A],load torque [N m]", "",
            {
                "t [s]": ("t", "s"), "angle [rad]": ("theta_m", "rad"), "current [A]": ("i_q", "A"),
                "load torque [N m]": ("load_torque", "N m"),
            },
        ),
        (
            "t [s],rpm,throttle [%],vbat [V],load [N]", "",  # no force acts on a rotary axis: its owner knows the lead
            {
                "t [s]": ("t", "s"), "rpm": ("w_m", "rpm"), "throttle [%]": ("duty", "%"), "vbat [V]": ("u_dc", "V"),
                "load [N]": "ignore",
            },
        ),
        (
            "t [s],joint torque [N m],load torque [N m],angle [rad]", "",  # of two torques one is the drive's
            {
                "t [s]": ("t", "s"), "joint torque [N m]": ("torque", "N m"),
                "load torque [N m]": ("load_torque", "N m"),
                "angle [rad]": ("theta_m", "rad"),
            },
        ),
        (
            "Time [ms],Position [mm],Force [N]", "",
            {"Time [ms]": ("t", "ms"), "Position [mm]": ("q", "mm"), "Force [N]": ("force", "N")},
        ),
        (
            "time,goal,angle,torque", "s,rad,rad,N m",
            {
                "time": ("t", "s"), "goal": ("theta_ref", "rad"), "angle": ("theta_m", "rad"),
                "torque": ("torque", "N m"),
            },
        ),
        (
            "timestamp,goal_position,motorPos,motorVelocity_rpm,Iq,V_bus", "",
            {
                "timestamp": ("t", "s"), "goal_position": ("theta_ref", "rad"), "motorPos": ("theta_m", "rad"),
                "motorVelocity_rpm": ("w_m", "rpm"), "Iq": ("i_q", "A"), "V_bus": "ignore",
            },
        ),
        (
            "stamp_us,motor_vel_dps,motor_current_A,case_temp_C", "",
            {
                "stamp_us": ("t", "us"), "motor_vel_dps": ("w_m", "deg/s"), "motor_current_A": ("i_q", "A"),
                "case_temp_C": ("temp_w", "°C"),
            },
        ),
        (
            "t_s,Phase A,Phase B,Phase C,rotor angle (deg),lvdt (deg),cmd (deg),Temp (°C)", "",
            {
                "t_s": ("t", "s"), "Phase A": ("i_a", "A"), "Phase B": ("i_b", "A"), "Phase C": ("i_c", "A"),
                "rotor angle (deg)": ("theta_m", "deg"), "lvdt (deg)": ("theta_u", "deg"),
                "cmd (deg)": ("theta_cmd", "deg"), "Temp (°C)": ("temp_w", "°C"),
            },
        ),
        (
            "Zeit [ms],Tisch Position [mm],Motorwinkel [Grad],Motordrehzahl [U/min],Strom Iq [A],Soll Position [mm]",
            "",
            {
                "Zeit [ms]": ("t", "ms"), "Tisch Position [mm]": ("q", "mm"), "Motorwinkel [Grad]": ("theta_m", "deg"),
                "Motordrehzahl [U/min]": ("w_m", "rpm"), "Strom Iq [A]": ("i_q", "A"),
                "Soll Position [mm]": ("q_ref", "mm"),
            },
        ),
        (
            "timestamp_us,goal_position_deg,present_position_deg,pwm_percent,supply_V,bus_current_A", "",
            {
                "timestamp_us": ("t", "us"), "goal_position_deg": ("theta_ref", "deg"),
                "present_position_deg": ("theta_m", "deg"), "pwm_percent": ("duty", "%"), "supply_V": ("u_dc", "V"),
                "bus_current_A": "ignore",
            },
        ),
        (
            "[ms],[V],[turns],[turns/s]", "",
            {
                "[ms]": ("t", "ms"), "[V]": ("u_q", "V"), "[turns]": ("theta_m", "turns"),
                "[turns/s]": ("w_m", "turns/s"),
            },
        ),
        (
            "t [s],force cmd [N],x pos [mm]", "",
            {"t [s]": ("t", "s"), "force cmd [N]": ("force", "N"), "x pos [mm]": ("q", "mm")},
        ),
        (
            "t [s],torque cmd [N m],torque [N m],angle [deg]", "",
            {
                "t [s]": ("t", "s"), "torque cmd [N m]": "ignore", "torque [N m]": ("torque", "N m"),
                "angle [deg]": ("theta_m", "deg"),
            },
        ),
    ],
)  # fmt: skip
def test_titles_and_units_of_strangers(tmp_path, titles, units, wanted):
    _, answer = mapped(tmp_path, titles, units)
    assert answer.exit_code == 0
    assert channels(answer) == wanted


def test_a_unit_that_the_file_does_not_give_is_asked_for(tmp_path):
    _, answer = mapped(tmp_path, "time,position,current")
    assert "the file gives no unit: is it rad?" in answer.stdout


def test_a_torque_in_per_cent_wants_its_rating(tmp_path):
    _, answer = mapped(tmp_path, "Time (s),Position actual (deg),Torque actual (%)")
    assert channels(answer)["Torque actual (%)"] == "ignore"
    assert "{channel: torque, unit: N m, scale: 0.025} where 100 % are 2.5 N m" in answer.stdout


def test_a_commanded_drive_is_said_to_be_one(tmp_path):
    _, answer = mapped(tmp_path, "t [s],force cmd [N],x pos [mm]")
    assert "commanded, and taken for what acts since no measured one is there" in answer.stdout


def test_a_second_column_of_a_kind_is_left_out_and_said(tmp_path):
    _, answer = mapped(tmp_path, "t [s],position 1 [rad],position 2 [rad],i_q [A]")
    assert channels(answer)["position 2 [rad]"] == "ignore"
    assert "looks like theta_m too, as 'position 1 [rad]' does" in answer.stdout
    assert "of a neighbouring axis it would be {channel: theta_n, unit: rad}" in answer.stdout


def test_what_is_written_is_read_and_not_written_over(tmp_path):
    path, answer = mapped(tmp_path, "Time [ms],Position [mm],Force [N]", "", "--write")
    assert answer.exit_code == 0
    (cycle,) = read_record(path)
    assert np.diff(cycle["t"]) == pytest.approx(1e-3)
    assert cycle["q"] == pytest.approx([0.001, 0.002, 0.003])
    with pytest.raises(ConfigError, match="exists, and is not overwritten"):
        mapped(tmp_path, "Time [ms],Position [mm],Force [N]", "", "--write")


def test_without_a_time_the_answer_is_no(tmp_path):
    with pytest.raises(NegativeAnswer, match="no column looks like a time"):
        mapped(tmp_path, "position [rad],winding (°C)")


def test_what_has_a_speed_is_no_reading_at_rest(tmp_path):
    """A winch's log counted ticks: as a map at rest its speed was told to be constant at 0."""
    with pytest.raises(NegativeAnswer, match="map one by hand"):
        mapped(tmp_path, "tick,drum_enc_rev,drum_speed_rpm,torque_kNm")


def test_a_file_without_a_known_time_names_the_command(tmp_path):
    path, _ = mapped(tmp_path, "Time [ms],Position [mm],Force [N]")
    with pytest.raises(RecordError, match=f"'ema records map {path}' proposes"):
        CliRunner().invoke(cli, ["records", "check", str(path)], catch_exceptions=False)


@pytest.mark.parametrize(
    ("path", "said"), [("nosuch.csv", "No such file"), (".", "a folder"), ("/dev/zero", "a device")]
)
def test_what_is_no_file_is_refused_in_one_line(path, said):
    with pytest.raises(RecordError, match=f"cannot be read .*{said}"):
        CliRunner().invoke(cli, ["records", "map", path], catch_exceptions=False)


def test_a_drive_log_of_counts_and_revolutions(tmp_path):
    _, answer = mapped(tmp_path, "time[us],pos[counts],rpm,rpm_setpoint,joint_vel_deg_s,setpoint_deg")
    assert channels(answer) == {
        "time[us]": ("t", "us"),
        "pos[counts]": "ignore",
        "rpm": ("w_m", "rpm"),
        "rpm_setpoint": ("w_ref", "rpm"),
        "joint_vel_deg_s": "ignore",
        "setpoint_deg": ("theta_ref", "deg"),
    }
    assert "{channel: theta_m, unit: turn, scale: 2.44140625e-4} where 4096 are a turn" in answer.stdout
    _, answer = mapped(tmp_path, "time_s,joint_vel_deg_s,link_torque_Nm")
    assert channels(answer)["joint_vel_deg_s"] == ("w_m", "deg/s")


def test_lines_above_the_titles_and_an_old_encoding_are_told(tmp_path):
    path = tmp_path / "riemen.csv"
    rows = "".join(f"0,{k:03d};1,5;0,2{k}\n" for k in range(5))
    path.write_bytes(f"Prüfstand Riemenachse;;\n\nZeit;Istposition;Motorstrom\ns;mm;A\n{rows}".encode("cp1252"))
    answer = CliRunner().invoke(cli, ["records", "map", str(path), "--write"], catch_exceptions=False)
    assert answer.exit_code == 0
    side = yaml.safe_load(path.with_name("riemen.record.yaml").read_text())
    assert (side["encoding"], side["skip_rows"]) == ("cp1252", 2)
    record = read_record(path)
    assert {"t", "i_q"} <= set(record.channels)
    assert record.cycles[0]["i_q"][1] == 0.21


@pytest.mark.slow
def test_a_map_of_torque_over_angle_is_readings_at_rest(tmp_path):
    path = tmp_path / "map.txt"
    up = np.arange(0.0, 360.0, 0.5)
    angle, direction = np.concatenate([up, up[::-1]]), np.repeat([1.0, -1.0], len(up))
    torque = 3.5 * direction + 8.0 * np.sin(np.deg2rad(36.0 * angle) + 0.4)
    torque += 0.25 * np.random.default_rng(1).standard_normal(len(torque))
    rows = "\n".join(f"{a:.1f}\t{b:.4f}" for a, b in zip(angle, torque, strict=True))
    path.write_text(f"angle_deg\ttorque_mNm\n{rows}\n")
    run = CliRunner()
    assert run.invoke(cli, ["records", "map", str(path), "--write"], catch_exceptions=False).exit_code == 0
    assert "at_rest: true" in path.with_name("map.record.yaml").read_text()
    out = tmp_path / "plant.yaml"
    done = run.invoke(cli, ["plant", "init", str(path), "--out", str(out)], catch_exceptions=False)
    assert done.exit_code == 0
    plant = axis_config.load(out)
    assert pytest.approx(3.5e-3, rel=0.1) == plant.F_d
    (term,) = describe(balance(AxisPlant(plant, [read_record(path)])), linear=False)["terms"]
    values = {name: q["value"] for name, q in term["parameters"].items()}
    assert values == pytest.approx({"amplitude": 8e-3, "order": 36.0, "phase": 0.4}, rel=0.02)


def test_of_a_file_without_titles_time_is_proposed_and_the_rest_told_by_its_numbers(tmp_path):
    t = np.arange(50) * 0.01
    np.savetxt(tmp_path / "bench.csv", np.stack([np.sin(9.0 * t), 3.0 + t], axis=1), delimiter=",", fmt="%.6f")
    answer = CliRunner().invoke(cli, ["records", "map", str(tmp_path / "bench.csv")], catch_exceptions=False)
    assert channels(answer) == {"column 1": "ignore", "column 2": ("t", "s")}
    assert "goes from -0.9" in answer.stdout
