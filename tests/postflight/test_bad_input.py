"""Every post-flight command on every kind of bad input: one clear line, nothing written, nothing overwritten."""

import gc
import shutil

import can
import numpy as np
import pytest
from click.testing import CliRunner
from ema_postflight.discrepancy import discrepancy
from ema_postflight.export import export
from ema_postflight.identify_command import identify
from ema_postflight.recover import recover
from ema_postflight.replay import replay
from ema_postflight.report import report
from ema_postflight.watch import watch
from ema_simulator.command import simulate
from ema_simulator.inject import inject

from ema.core import resources
from ema.core.errors import EmaError, LogError, NegativeAnswer
from ema.log import LogReader, LogSettings
from ema.log.segmented import SegmentedLog

PLANT = str(resources.config("actuator.yaml"))
NO_NUMBER = ("nan", "inf", "-inf")
COMMANDS = {
    "report": (report, ["--out", "{out}.html"]),
    "export": (export, ["--out", "{out}"]),
    "export frames": (export, ["--out", "{out}.blf"]),
    "replay onto": (replay, ["--onto", "virtual:bad", "--speed", "inf"]),
    "replay identify": (replay, ["--identify", "--bundle", "{bundle}", "--out", "{out}.mcap", "--cycles", "{out}.csv"]),
    "identify": (identify, ["--bundle", "{bundle}"]),
    "recover": (recover, ["--out", "{out}"]),
}


@pytest.fixture(scope="module")
def inputs(tmp_path_factory, flight):
    """Bad inputs by name."""
    folder = tmp_path_factory.mktemp("bad")
    rng = np.random.default_rng(3)
    whole = sorted(flight.glob("*.mcap"))[0].read_bytes()
    (folder / "empty.mcap").touch()
    (folder / "noise.mcap").write_bytes(rng.bytes(3000))
    (folder / "begun.mcap").write_bytes(whole[:60])
    (folder / "directory").mkdir()
    (folder / "text.txt").write_text("a letter")
    (folder / "noise.blf").write_bytes(rng.bytes(300))
    (folder / "noise.asc").write_bytes(rng.bytes(300))
    (folder / "noise.log").write_text("not what candump writes\n")
    (folder / "nothing").mkdir()
    SegmentedLog(folder / "nothing", {}, LogSettings(keep_free=0), 10**18, 0.0).close()
    with can.Logger(folder / "other.mcap") as log:  # another DBC's frames
        for i in range(50):
            log(can.Message(timestamp=1.7e9 + 0.01 * i, arbitration_id=0x100 + i % 7, is_extended_id=False, data=b"12"))
    return folder


def _run(command, path, tmp_path, bundle):
    function, options = COMMANDS[command]
    filled = [option.format(out=tmp_path / "out", bundle=bundle) for option in options]
    return CliRunner().invoke(function, [str(path), *filled])


# what a command may well do with one of them: send or convert frames of whatever kind, find a file sound
FINE = {
    *(("export frames", "other.mcap"), ("replay onto", "other.mcap")),
    *(("recover", "nothing"), ("recover", "other.mcap")),
}
RESCUED = ("recover", "begun.mcap")  # what is in it is in a copy: exit status 1
NAMES = (
    "missing.mcap", "empty.mcap", "noise.mcap", "begun.mcap", "directory", "nothing", "other.mcap", "text.txt",
    "noise.blf", "noise.asc", "noise.log",
)  # fmt: skip


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # python-can leaves a bad BLF file open
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("command", COMMANDS)
def test_bad_input_is_told_in_one_line(command, name, inputs, tmp_path, coarse_bundle):
    answer = _run(command, inputs / name, tmp_path, coarse_bundle.path)
    gc.collect()
    if (command, name) in FINE:
        assert answer.exit_code == 0, answer.output
        return
    assert answer.exit_code != 0, answer.output
    if answer.exception is not None and not isinstance(answer.exception, SystemExit):
        assert isinstance(answer.exception, EmaError), repr(answer.exception)
        assert "\n" not in str(answer.exception)
        assert (command, name) == RESCUED or name.split(".")[0] in str(answer.exception), answer.exception
    if (command, name) == RESCUED:
        assert isinstance(answer.exception, NegativeAnswer)
        return
    left = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert left == [], "half an answer is left"


@pytest.mark.parametrize("command", [name for name in COMMANDS if name not in ("identify", "replay onto")])
def test_nothing_is_overwritten(command, flight, tmp_path, coarse_bundle):
    (tmp_path / "out").mkdir()
    first = sorted(flight.glob("*.mcap"))[0]
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(first.read_bytes()[:-20])
    mine = [tmp_path / name for name in ("out.html", "out.blf", "out.mcap", "out.csv", "out/cut.recovered.mcap")]
    mine += [tmp_path / f"out/{table}.csv" for table in ("estimates", "envelopes", "events", "status")]
    for path in mine:
        path.write_text("mine")
    answer = _run(command, cut, tmp_path, coarse_bundle.path)
    assert isinstance(answer.exception, LogError), repr(answer.exception)
    assert "is not overwritten" in str(answer.exception)
    assert {path.read_text() for path in mine} == {"mine"}


def test_a_truncated_log_is_read_as_far_as_it_goes(flight, tmp_path, coarse_bundle):
    cut = tmp_path / "cut.mcap"
    whole = sorted(flight.glob("*.mcap"))[0].read_bytes()
    cut.write_bytes(whole[: whole.rfind(b"zstd", 0, -2000)])  # in the middle of a chunk's head
    with LogReader(cut) as log:
        n = sum(1 for _ in log.messages(lambda topic: topic.startswith("/estimate")))
        assert log.unfinished
    assert n > 0
    for command in ("report", "export", "recover"):
        answer = _run(command, cut, tmp_path, coarse_bundle.path)
        assert isinstance(answer.exception, NegativeAnswer), (n, answer.output, answer.exception)  # it is said


@pytest.mark.parametrize("command", ["recover", "discrepancy"])
def test_a_folder_that_cannot_be_made_is_told(command, flight, tmp_path):
    (tmp_path / "taken").write_text("mine")
    function, more = {"recover": (recover, []), "discrepancy": (discrepancy, ["--plant", PLANT])}[command]
    record = tmp_path / "record.csv"
    record.write_text("t [s],i_a [A]\n0,1\n1,2\n")
    given = str(flight if command == "recover" else record)
    answer = CliRunner().invoke(function, [given, *more, "--out", str(tmp_path / "taken")])
    assert isinstance(answer.exception, EmaError)
    assert str(answer.exception) == f"{tmp_path / 'taken'}: cannot be made (File exists)"


def test_a_record_given_as_a_log_of_frames_is_told_what_is_wanted(tmp_path):
    (tmp_path / "record.csv").write_text("t [s],i_a [A],i_b [A]\n0,1,2\n")
    answer = CliRunner().invoke(replay, [str(tmp_path / "record.csv"), "--onto", "virtual:bad"])
    assert isinstance(answer.exception, LogError)
    assert "timestamp,arbitration_id" in str(answer.exception)
    assert "ValueError" not in str(answer.exception)


@pytest.mark.parametrize("command", ["replay identify", "identify"])
def test_a_bundle_of_another_version_is_refused(command, flight, coarse_bundle, tmp_path):
    bundle = tmp_path / "bundle"
    shutil.copytree(coarse_bundle.path, bundle)
    manifest = bundle / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"version": ', '"version": 9'))
    answer = _run(command, sorted(flight.glob("*.mcap"))[0], tmp_path, bundle)
    assert isinstance(answer.exception, EmaError)
    assert "version 9" in str(answer.exception)


@pytest.mark.parametrize(
    ("function", "options"),
    [
        *(
            (f, [option, value])
            for f in (export, report, replay)
            for option in ("--start", "--end")
            for value in NO_NUMBER
        ),
        *((replay, ["--onto", "virtual:x", option, "nan"]) for option in ("--speed", "--skip-gaps")),
        (replay, ["--onto", "virtual:x", "--skip-gaps", "inf"]),
        *((watch, ["--for", value]) for value in NO_NUMBER),
        *((simulate, ["--scenario", "x.yaml", "--rate", value]) for value in NO_NUMBER),
        *((inject, ["--ramp", value]) for value in NO_NUMBER),
    ],
)
def test_what_is_no_finite_number_is_refused(function, options, flight, tmp_path):
    log = [str(flight)] if function in (export, report, replay) else []
    out = ["--out", str(tmp_path / "out")] if function in (export, report) else []
    answer = CliRunner().invoke(function, [*log, *out, *options])
    assert answer.exit_code == 2
    assert f"Invalid value for '{options[-2]}'" in answer.output


@pytest.mark.parametrize("command", ["report", "export", "export frames", "replay onto", "replay identify"])
@pytest.mark.parametrize("times", [("100", "1"), ("5", "5"), ("0", "2025-03-14T09:15:00Z")])
def test_an_end_before_the_start_is_told_as_that(command, times, flight, tmp_path, coarse_bundle):
    function, options = COMMANDS[command]
    filled = [option.format(out=tmp_path / "out", bundle=coarse_bundle.path) for option in options]
    answer = CliRunner().invoke(function, [str(flight), *filled, "--start", times[0], "--end", times[1]])
    assert answer.exit_code == 2
    assert "--start must be before --end" in answer.output
    assert not list(tmp_path.iterdir())


def test_a_bus_that_is_not_there_is_told():
    answer = CliRunner().invoke(watch, ["--bus", "nonsense:x", "--for", "1"])
    assert isinstance(answer.exception, EmaError)
