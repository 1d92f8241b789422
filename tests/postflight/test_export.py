import csv

import can
import numpy as np
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner
from ema_postflight.export import export

from ema.core.errors import LogError
from ema.log import LogReader


def _run(*arguments):
    return CliRunner().invoke(export, [str(a) for a in arguments], catch_exceptions=False)


def _read(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_tables_hold_what_the_log_holds_with_units_in_the_header(flight, tmp_path):
    answer = _run(flight, "--out", tmp_path / "t")
    assert answer.exit_code == 0, answer.output
    estimates = _read(tmp_path / "t/estimates.csv")
    with LogReader(flight) as log:
        logged = [m.content for m in log.messages(lambda topic: topic.startswith("/estimate"))]
    assert len(estimates) == len(logged) == 24
    for row, content in zip(estimates, logged, strict=True):
        assert [float(row[f"k{n} [1]"]) for n in range(1, 7)] == content["k"]
        assert int(row["t_ns [ns]"]) == content["t_ns"]
        assert float(row["residual [A]"]) == content["residual"]
    assert {row["reasons"] for row in estimates} == {"", "lost_frames"}
    envelopes = _read(tmp_path / "t/envelopes.csv")
    assert len(envelopes) == 24 * 30
    assert set(envelopes[0]) == {
        "t_ns [ns]", "actuator", "cycle", "t [s]", "measured [A]", "model [A]", "sd [A]"
    }  # fmt: skip
    assert [row["text"] for row in _read(tmp_path / "t/events.csv")] == ["one frame lost"]
    status = _read(tmp_path / "t/status.csv")
    assert [row["n_lost"] for row in status] == ["0"] * 5 + ["1"] * 7


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_signals_are_decoded_sample_by_sample(flight, tmp_path, kind):
    assert _run(flight, "--out", tmp_path, "--format", kind, "--what", "signals").exit_code == 0
    if kind == "csv":
        rows = _read(tmp_path / "PhaseCurrents.csv")
        i_a = np.array([float(row["i_a [A]"]) for row in rows])
        assert {row["check"] for row in rows} == {"ok"}
    else:
        table = pq.read_table(tmp_path / "PhaseCurrents.parquet")
        i_a = table["i_a [A]"].to_numpy()
        assert table.schema.field("i_a [A]").metadata == {b"unit": b"A"}
        assert table["sample"].to_pylist()[:11] == [*range(10), 0]
    assert len(i_a) == 12 * 2 * 5 * 10
    assert np.abs(i_a).max() <= 20
    assert len(np.unique(i_a)) > 1000


def test_parquet_and_csv_agree(flight, tmp_path):
    _run(flight, "--out", tmp_path, "--format", "parquet", "--what", "estimates")
    _run(flight, "--out", tmp_path, "--what", "estimates")
    table = pq.read_table(tmp_path / "estimates.parquet").to_pylist()
    rows = _read(tmp_path / "estimates.csv")
    assert [row["k3 [1]"] for row in table] == [float(row["k3 [1]"]) for row in rows]
    assert [row["t_ns [ns]"] for row in table] == [int(row["t_ns [ns]"]) for row in rows]


@pytest.mark.parametrize(("start", "end"), [("3.005", "7"), ("2025-03-14T09:15:03.005Z", "2025-03-14T09:15:07+00:00")])
def test_a_time_range_is_seconds_or_a_moment(flight, tmp_path, start, end):
    _run(flight, "--out", tmp_path, "--what", "estimates", "--start", start, "--end", end)
    assert sorted({int(row["cycle"]) for row in _read(tmp_path / "estimates.csv")}) == [3, 4, 5, 6]


def test_raw_frames_go_to_the_format_of_another_tool(flight, tmp_path):
    assert "frames" in _run(flight, "--out", tmp_path / "f.blf", "--end", "6").output
    with can.LogReader(tmp_path / "f.blf") as log:
        messages = list(log)
    assert len(messages) == 6 * 2 * 7
    assert messages[1].is_fd


def test_nothing_is_overwritten(flight, tmp_path):
    (tmp_path / "estimates.csv").write_text("mine")
    with pytest.raises(LogError, match=r"estimates\.csv: exists"):
        _run(flight, "--out", tmp_path)
    (tmp_path / "f.asc").write_text("mine")
    with pytest.raises(LogError, match=r"f\.asc: exists"):
        _run(flight, "--out", tmp_path / "f.asc")
    assert (tmp_path / "estimates.csv").read_text() == (tmp_path / "f.asc").read_text() == "mine"


def test_what_cannot_be_done_is_said_in_one_line(flight, tmp_path):
    with pytest.raises(LogError, match="does not exist"):
        _run(tmp_path / "absent.mcap", "--out", tmp_path / "x")
    with pytest.raises(LogError, match="holds no log"):
        _run(tmp_path, "--out", tmp_path / "x")
    with pytest.raises(LogError, match=r"No write support.*\.xyz"):
        _run(flight, "--out", tmp_path / "f.xyz")
    with pytest.raises(LogError, match="nothing of"):
        _run(flight, "--out", tmp_path / "x", "--start", "1000")
    assert _run(flight, "--out", tmp_path / "x", "--start", "noon").exit_code == 2
