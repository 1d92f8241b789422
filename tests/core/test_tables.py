"""Records as other tools write them: the same numbers, whatever the file looks like."""

from __future__ import annotations

import numpy as np
import pytest

from ema.core import config, sidecar
from ema.core.errors import RecordError
from ema.core.records import read_record

T, I, SPEED = np.arange(5) * 0.1, np.array([0.5, -1.25, 2.0, 0.0, 1e-3]), np.array([1.0, 2.0, 3.5, -4.0, 0.25])
PLAN = sidecar.Sidecar(
    columns={
        "zeit": sidecar.Column(channel="t", unit="s"),
        "strom": sidecar.Column(channel="i_q", unit="A"),
        "drehzahl": sidecar.Column(channel="w_m", unit="rad/s"),
    }
)


def rows(delimiter, decimal="."):
    lines = [delimiter.join(f"{x!r}" for x in map(float, row)) for row in zip(T, I, SPEED, strict=True)]
    return [line.replace(".", decimal) for line in lines]


TEXTS = {
    "comma": ["t [s],i_q [A],w_m [rad/s]", *rows(",")],
    "semicolon": ["t [s];i_q [A];w_m [rad/s]", *rows(";")],
    "semicolon and decimal comma": ["t [s];i_q [A];w_m [rad/s]", *rows(";", ",")],
    "tab": ["t [s]\ti_q [A]\tw_m [rad/s]", *rows("\t")],
    "tab and decimal comma": ["t [s]\ti_q [A]\tw_m [rad/s]", *rows("\t", ",")],
    "white space": ["t(s)   i_q(A)  w_m(rad/s)", *rows("   ")],
    "spaces about the titles": [" t [s] , i_q [A] ,  w_m [rad/s]", *rows(", ")],
    "spaces about bars": ["t(s) | i_q(A) | w_m(rad/s)", *rows(" | ")],
    "units in round brackets": ["t (s),i_q (A),w_m (rad/s)", *rows(",")],
    "a row of units": ["t,i_q,w_m", "s,A,rad/s", *rows(",")],
    "a row of units in brackets": ["t;i_q;w_m", "[s];[A];[rad/s]", *rows(";")],
    "comments": ["# a bench", "% its operator", "t [s],i_q [A],w_m [rad/s]", "// begin", *rows(",")],
    "titles in a comment": ["# a bench", "# t [s],i_q [A],w_m [rad/s]", *rows(",")],
    "DOS": ["t [s],i_q [A],w_m [rad/s]\r", *(row + "\r" for row in rows(","))],
    "text in a column that is no channel": [
        "t [s],i_q [A],note,w_m [rad/s]",
        *(",".join([*row.split(",")[:2], "fine", row.split(",")[2]]) for row in rows(",")),
    ],
    "thousands": [
        "t [s];i_q [mA];w_m [rad/s]",
        *(
            f"{t!r}".replace(".", ",") + f";{1000 * i:,.3f}".replace(",", "_").replace(".", ",").replace("_", ".")
            + f";{w!r}".replace(".", ",")
            for t, i, w in zip(map(float, T), map(float, I), map(float, SPEED), strict=True)
        ),
    ],
}  # fmt: skip


def check(record):
    (cycle,) = record.cycles
    assert cycle["t"] == pytest.approx(T)
    assert cycle["i_q"] == pytest.approx(I)
    assert cycle["w_m"] == pytest.approx(SPEED)


@pytest.mark.parametrize("name", TEXTS)
def test_text_is_read_as_it_comes(name, tmp_path):
    path = tmp_path / "bench.csv"
    path.write_text("\n".join(TEXTS[name]) + "\n", newline="")
    check(read_record(path))


def test_parquet(tmp_path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(
        pa.table({"t [s]": T, "i_q [A]": I, "w_m [rad/s]": SPEED.astype(np.float32)}), tmp_path / "x.parquet"
    )
    check(read_record(tmp_path / "x.parquet"))


def test_parquet_with_time_stamps_counts_from_the_first(tmp_path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    t = (1_700_000_000_000_000 + np.round(1e6 * T).astype(np.int64)).astype("datetime64[us]")
    table = pa.table({"zeit": pa.array(t), "strom": I, "drehzahl": SPEED})
    pq.write_table(table, tmp_path / "x.parquet")
    check(read_record(tmp_path / "x.parquet", PLAN))


@pytest.mark.parametrize("nested", [False, True])
def test_matlab(nested, tmp_path):
    from scipy.io import savemat

    values = {"zeit": T, "strom": I[:, None], "drehzahl": SPEED[None, :], "gain": 3.0, "note": "a bench"}
    if nested:
        plan = {f"run.{name}": column for name, column in PLAN.columns.items()}
        savemat(tmp_path / "x.mat", {"run": values})
    else:
        plan = PLAN.columns
        savemat(tmp_path / "x.mat", values)
    check(read_record(tmp_path / "x.mat", sidecar.Sidecar(columns=plan)))


def test_matlab_7_3(tmp_path):
    import h5py

    with h5py.File(tmp_path / "x.mat", "w", userblock_size=512) as file:
        for name, x in {"zeit": T, "strom": I, "drehzahl": SPEED}.items():
            file[name] = x[:, None].T
    with (tmp_path / "x.mat").open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(128))
    check(read_record(tmp_path / "x.mat", PLAN))


def test_what_a_plant_file_says_of_columns_counts_where_no_sidecar_does(tmp_path):
    path = tmp_path / "bench.csv"
    path.write_text("\n".join(["zeit;strom;drehzahl", *rows(";", ",")]))
    check(read_record(path, PLAN))
    with pytest.raises(RecordError, match="missing column"):
        read_record(path)
    (tmp_path / "bench.record.yaml").write_text("columns: {zeit: {channel: t, unit: min}, drehzahl: ignore}")
    assert read_record(path, PLAN).cycles[0]["t"] == pytest.approx(60 * T)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("x.parquet", b"not parquet", "cannot be read as Parquet"),
        ("x.mat", b"not matlab at all" * 20, "cannot be read as MATLAB"),
        ("x.mat", b"", "cannot be read as MATLAB"),
        ("x.csv", "t [s],i_q [A],Ströme\n0,1,2\n1,2,3\n".encode("latin-1"), "encoding: latin-1"),
    ],
)
def test_what_cannot_be_read_is_one_line(name, content, says, tmp_path):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(RecordError, match=says) as caught:
        read_record(tmp_path / name)
    assert "\n" not in str(caught.value)


def test_columns_without_titles_are_called_by_their_number(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text("\n".join(rows(";", ",")))
    with pytest.raises(RecordError, match=r"missing column 't \[s\]' \(columns: column 1, column 2, column 3\)"):
        read_record(path)
    plan = {f"column {k + 1}": column for k, column in enumerate(PLAN.columns.values())}
    check(read_record(path, sidecar.Sidecar(columns=plan)))


def test_what_the_owner_says_is_to_be_ignored_is_understood(tmp_path):
    (tmp_path / "x.csv").write_text("t [s],i_q [A],note,why\n0,1,2,3\n1,2,3,4\n")
    (tmp_path / "x.record.yaml").write_text("columns: {note: ignore}")
    assert read_record(tmp_path / "x.csv").ignored == ("why",)


def test_a_plan_that_names_a_column_that_is_not_there_is_told_as_the_plant_file_s(tmp_path):
    (tmp_path / "x.csv").write_text("t [s],i_q [A]\n0,1\n1,2\n")
    with pytest.raises(RecordError, match="plant file, key 'record': no column drehzahl, strom, zeit"):
        read_record(tmp_path / "x.csv", PLAN)


def test_the_plan_is_no_part_of_what_a_bundle_was_made_for(tmp_path):
    from ema.core import resources
    from ema.models.actuator import Actuator

    plain = config.load(resources.config("actuator.yaml"), Actuator)
    text = resources.config("actuator.yaml").read_text()
    (tmp_path / "p.yaml").write_text(text + "\nrecord: {columns: {zeit: {channel: t, unit: s}}}\n")
    assert config.digest(config.load(tmp_path / "p.yaml", Actuator)) == config.digest(plain)
