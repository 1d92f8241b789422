"""What the numbers of columns show that titles do not say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yaml
from click.testing import CliRunner

from ema.cli import cli
from ema.core.table import Table
from ema.discrepancy.records.shown import FEWEST, Shown


def channels(said):
    columns = yaml.safe_load(said)["columns"]
    return {title: one if one == "ignore" else (one["channel"], one["unit"]) for title, one in columns.items()}


def shown(*columns):
    lines = range(len(columns[0]))
    return Shown(Table(Path("bench.csv"), ["x"] * len(columns), lambda of: [columns[k] for k in of], lines))


def test_a_multiple_is_told_from_what_is_only_alike_and_from_nothing():
    x = np.sin(np.arange(100.0))
    of = shown(x, -0.25 * x, 0.25 * x + 0.02, 0.0 * x)
    assert of.ratio(1, [0]) == (0, -0.25)
    assert of.ratio(2, [0]) is None
    assert of.ratio(3, [0]) is None
    assert [of.is_zero(k) for k in range(4)] == [False, False, False, True]


def test_few_rows_show_nothing():
    x = np.sin(np.arange(FEWEST - 1.0))
    assert shown(x, 2.0 * x).ratio(1, [0]) is None


def test_numbers_show_a_supply_and_a_torque_that_was_computed(tmp_path):
    """As a drive logs them: the voltage of its bus, and a torque that is its current times a constant."""
    t = 0.01 * np.arange(200)
    current = np.sin(5.0 * t)
    sensor = 0.3 * np.sin(5.0 * t) + 0.05 * np.cos(31.0 * t)
    columns = {
        "time [s]": t, "angle [rad]": np.cos(5.0 * t), "torque [Nm]": np.round(0.1095 * current, 4), "iq [A]": current,
        "voltage [V]": 36.0 - 0.4 * np.abs(current), "axis 2 torque [Nm]": 0.0 * t, "sensor torque [Nm]": sensor,
    }  # fmt: skip
    path = tmp_path / "bench.csv"
    np.savetxt(path, np.column_stack([*columns.values()]), delimiter=",", header=",".join(columns), comments="")
    answer = CliRunner().invoke(cli, ["records", "map", str(path)], catch_exceptions=False)
    assert channels(answer.stdout) == {
        "time [s]": ("t", "s"), "angle [rad]": ("theta_m", "rad"), "torque [Nm]": "ignore", "iq [A]": ("i_q", "A"),
        "voltage [V]": ("u_dc", "V"), "axis 2 torque [Nm]": "ignore", "sensor torque [Nm]": ("torque", "Nm"),
    }  # fmt: skip
    assert "0.1095 times 'iq [A]': computed from it, no measurement" in answer.stdout
    assert "load_torque" in next(line for line in answer.stdout.splitlines() if "sensor" in line)


def test_a_voltage_that_drives_one_way_is_no_supply(tmp_path):
    """A motor that runs up on a steady voltage: its current falls and never turns round."""
    t = 0.01 * np.arange(200)
    columns = {
        "t [s]": t,
        "speed [rad/s]": 50.0 * (1.0 - np.exp(-t)),
        "current [A]": np.exp(-t),
        "voltage [V]": 12.0 + 0.0 * t,
    }
    path = tmp_path / "bench.csv"
    np.savetxt(path, np.column_stack([*columns.values()]), delimiter=",", header=",".join(columns), comments="")
    answer = CliRunner().invoke(cli, ["records", "map", str(path)], catch_exceptions=False)
    assert channels(answer.stdout)["voltage [V]"] == ("u_q", "V")
