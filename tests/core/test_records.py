"""Records: what is written is read back; whatever is wrong with a file is said in one line."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from ema.core.csv_records import write_csv
from ema.core.errors import EmaError, RecordError
from ema.core.names import CHANNELS
from ema.core.records import Cycle, Record, read_record, require

finite = st.floats(allow_nan=False, allow_infinity=False, width=64)


@st.composite
def records(draw):
    names = draw(st.lists(st.sampled_from(sorted(set(CHANNELS) - {"t"})), min_size=1, max_size=4, unique=True))
    numbers = draw(st.lists(st.integers(0, 2**32 - 1), min_size=1, max_size=4, unique=True))
    cycles = []
    for number in numbers:
        n = draw(st.integers(1, 5))
        steps = draw(hnp.arrays(float, n, elements=st.floats(1e-6, 1.0)))
        channels = {"t": np.cumsum(steps), **{name: draw(hnp.arrays(float, n, elements=finite)) for name in names}}
        cycles.append(Cycle(number, channels))
    return Record(tuple(cycles))


@given(record=records())
def test_written_record_reads_back_exactly(record, tmp_path_factory):
    path = tmp_path_factory.mktemp("records") / "r.csv"
    write_csv(record, path)
    again = read_record(path)
    assert [c.number for c in again] == [c.number for c in record]
    for ours, theirs in zip(record, again, strict=True):
        assert set(ours.channels) == set(theirs.channels)
        for name in ours.channels:
            np.testing.assert_array_equal(ours[name], theirs[name])


@given(text=st.text(max_size=200))
def test_arbitrary_text_is_a_record_or_one_clear_line(text, tmp_path_factory):
    path = tmp_path_factory.mktemp("records") / "r.csv"
    path.write_text(text, encoding="utf-8", errors="surrogateescape", newline="")
    said = ""
    try:
        read_record(path)
    except RecordError as error:
        said = str(error)
    assert "\n" not in said
    assert said == "" or str(path) in said


def write(tmp_path, text, sidecar=None):
    path = tmp_path / "r.csv"
    path.write_text(text)
    if sidecar is not None:
        (tmp_path / "r.record.yaml").write_text(sidecar)
    return path


def test_never_overwrites_unless_told(tmp_path):
    record = Record((Cycle(0, {"t": np.array([0.0, 1.0]), "i_q": np.array([1.0, 2.0])}),))
    path = tmp_path / "r.csv"
    write_csv(record, path)
    before = path.read_bytes()
    with pytest.raises(RecordError, match="not overwritten"):
        write_csv(record, path)
    assert path.read_bytes() == before
    write_csv(record, path, overwrite=True)
    assert [p.name for p in tmp_path.iterdir()] == ["r.csv"]


def test_unit_is_converted(tmp_path):
    path = write(tmp_path, "t [ms], theta_m [deg], temp_w [K]\n0, 180, 273.15\n1, -90, 293.15\n")
    (cycle,) = read_record(path)
    np.testing.assert_allclose(cycle["t"], [0, 1e-3])
    np.testing.assert_allclose(cycle["theta_m"], [np.pi, -np.pi / 2])
    np.testing.assert_allclose(cycle["temp_w"], [0, 20], atol=1e-9)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty"),
        ("t [s],i_a [A]\n", "no rows"),
        ("t [s],i_a [A]\n0,1\n1,2\n2\n", "line 4: has 1 of 2 fields"),
        ("t [s],i_a [A]\n0,1\n1,2,3\n2,3\n", "line 3: has 3 of 2 fields"),
        ("t [s],i_a [A]\n0,1\n1,nan\n2,3\n", "line 3: i_a is not a finite number"),
        ("t [s],i_a [A]\n0,1\n1,\n2,3\n", "line 3: column 'i_a [A]' is empty"),
        ("t [s],i_a [A]\n0,1\n1,spam\n2,3\n", "'spam' is not a number"),
        ("t [s],i_a [V]\n0,1\n", "[V] cannot be converted to [A]"),
        ("t [s],i_a [furlong per]\n0,1\n", "not a known unit"),
        ("t [s],i_a\n0,1\n", "has no unit, expected 'i_a [A]'"),
        ("time [s],i_a [A]\n0,1\n", "missing column 't [s]'"),
        ("t [s],i_a [A]\n0,1\n1,1\n1,1\n", "line 4: t goes from 1 to 1 s; a record of several cycles needs"),
        ("cycle,t [s],i_a [A]\n0,0,1\n0,1,1\n0,0.5,1\n", "line 4: t goes from 1 to 0.5"),
        ("cycle,t [s],i_a [A]\n0,0,1\n1,0,1\n0,1,1\n", "line 4: cycle 0 comes up again"),
        ("cycle,t [s],i_a [A]\n0.5,0,1\n", "cycle is not an integer"),
        ("t [s],i_a [A],i_a [mA]\n0,1,1\n", "given twice"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, text, said):
    path = write(tmp_path, text)
    with pytest.raises(RecordError) as caught:
        read_record(path)
    assert said in str(caught.value)
    assert str(path) in str(caught.value)


def test_missing_file_directory_and_binary(tmp_path):
    with pytest.raises(RecordError, match="no such file"):
        read_record(tmp_path / "none.csv")
    with pytest.raises(RecordError, match="is a directory"):
        read_record(tmp_path)
    binary = tmp_path / "b.csv"
    binary.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(RecordError, match="not UTF-8"):
        read_record(binary)


def test_columns_that_are_no_channel_are_named_not_guessed(tmp_path):
    record = read_record(write(tmp_path, "t [s],i_a [A],note\n0,1,x\n1,2,y\n"))
    assert record.ignored == ("note",)
    with pytest.raises(RecordError, match=r"missing channel i_b \[A\] \(has t, i_a; columns not understood: note\)"):
        require(record, ("i_a", "i_b"))


BENCH = "Time; Position; Iq; Flag\n5.0; 1; 512; 1\n5.1; 2; 512; 1\n5.2; 3; 512; 0\n5.9; 4; 512; 0\n"
COLUMNS = """
columns:
  Time: {channel: t, unit: s}
  Position: {channel: theta_m, unit: deg, sign: -1, offset: 10}
  Iq: {channel: i_q, unit: A, scale: 0.0009765625, resolution: 0.0009765625}
  Flag: ignore
delimiter: ";"
"""


@pytest.mark.parametrize(
    ("rule", "lengths", "starts"),
    [
        ("", [4], [5.0]),
        ("cycles: {rows: [[0, 2], [1, 3]]}", [2, 2], [0.0, 0.0]),
        ("cycles: {length: 3}", [3, 1], [0.0, 0.0]),
        ("cycles: {column: Flag}", [2, 2], [0.0, 0.0]),
        ("cycles: {gap: 200 ms}", [3, 1], [0.0, 0.0]),
    ],
)
def test_sidecar_names_columns_and_cycles(tmp_path, rule, lengths, starts):
    record = read_record(write(tmp_path, BENCH, COLUMNS + rule))
    assert [cycle.n_samples for cycle in record] == lengths
    assert [cycle["t"][0] for cycle in record] == starts
    assert record.cycles[0]["theta_m"][0] == pytest.approx(np.deg2rad(-1 + 10))
    assert record.cycles[0]["i_q"][0] == 0.5
    assert record.resolution["i_q"] == 2**-10


@pytest.mark.parametrize(
    ("sidecar", "said"),
    [
        ("columns: {Speed: {channel: w_m, unit: rad/s}}\ndelimiter: ';'", "no column Speed"),
        ("columns: {Time: {channel: time, unit: s}}\ndelimiter: ';'", "unknown channel"),
        ("columns: {Time: {channel: t, unit: V}}\ndelimiter: ';'", "[V] cannot be converted to [s]"),
        ("colums: {}", "'colums' is unknown"),
        (COLUMNS + "cycles: {rows: [[0, 9]]}", "[0, 9] lie outside the 4 rows"),
        (COLUMNS + "cycles: {rows: [[2, 1]]}", "0 <= start < stop"),
        (COLUMNS + "cycles: {column: Knob}", "'Knob' is no column"),
        (COLUMNS + "cycles: {length: 2, column: Flag}", "give exactly one"),
        (COLUMNS + "cycles: {gap: 2 A}", "wrong unit"),
    ],
)
def test_sidecar_mistakes_are_said(tmp_path, sidecar, said):
    path = write(tmp_path, BENCH, sidecar)
    with pytest.raises(EmaError) as caught:
        read_record(path)
    assert said in str(caught.value)


def test_require(tmp_path):
    record = read_record(write(tmp_path, "cycle,t [s],i_q [A]\n0,0,1\n0,1,1\n1,0,1\n"))
    require(record, ("t", "i_q"), min_samples=1)
    with pytest.raises(RecordError, match="cycle 1 has 1 samples, at least 2"):
        require(record, ("t",))
    with pytest.raises(RecordError, match="2 cycles, at least 3"):
        require(record, ("t",), min_samples=1, min_cycles=3)
    with pytest.raises(RecordError, match="i_q is constant at 1 A"):
        require(record, ("i_q",), min_samples=1, varying=("i_q",))
    with pytest.raises(RecordError, match=r"cycle 0: channel 'u_dc' \[V\] is missing"):
        record.cycles[0]["u_dc"]


def test_large_file_is_read_whole(tmp_path):
    n = 20_000
    path = write(tmp_path, "t [s],i_q [A]\n" + "\n".join(f"{k / 1e4},{k}" for k in range(n)) + "\n")
    (cycle,) = read_record(path)
    assert cycle.n_samples == n
    assert cycle.period == pytest.approx(1e-4)


def test_a_ratio_needs_no_unit(tmp_path):
    path = tmp_path / "servo.csv"
    path.write_text("t [s],duty,theta_m [rad]\n0,0.1,0\n0.001,0.2,0.1\n0.002,0.1,0.2\n", encoding="utf-8")
    (cycle,) = read_record(path).cycles
    assert cycle["duty"].tolist() == [0.1, 0.2, 0.1]
