"""The daemon's estimates again from its log: the same to the last bit."""

import csv
import json
import shutil

import can
import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from ema_daemon.sinks import LogSink
from ema_postflight.export import export
from ema_postflight.replay import replay

from ema import bundle as bundles
from ema.bus import codec as codecs
from ema.core.can_messages import message
from ema.core.errors import BundleError, LogError, NegativeAnswer
from ema.log import LogReader, LogSettings, LogWriter
from ema.monitor import Event, Identified, Monitor, MonitorSettings, Runner, SampledEnvelope
from ema.monitor.jobs import answered

SCENARIO = {
    "n_cycles": 8,
    "seed": 5,
    "actuators": [{"number": 0, "faults": {"k1": 0.05, "k4": 0.03}}, {"number": 7, "faults": {"k2": 0.1}}],
    "disturbances": {"drop": 0.002, "repeat": 0.001, "corrupt": 0.001, "reorder": 0.001},
}
MONITOR = {"slower": {"lf2": {"every": 3.0}}}


@pytest.fixture(scope="module")
def recorded(coarse_bundle, fly, tmp_path_factory):
    """Directory of a log as the daemon writes it: two actuators on a bad bus, linear and LF2."""
    directory = tmp_path_factory.mktemp("recorded")
    numbers = (0, 7)
    monitor = Monitor(dict.fromkeys(numbers, coarse_bundle), codecs.default(), MonitorSettings.model_validate(MONITOR))
    runner = Runner(dict.fromkeys(numbers, coarse_bundle))
    configuration = {"actuators": {n: {"bundle": str(coarse_bundle.path)} for n in numbers}, "monitor": MONITOR}
    attachments = {
        "daemon.yaml": yaml.safe_dump(configuration).encode(),
        "manifest.json": json.dumps(coarse_bundle.manifest).encode(),
    }
    frames = np.concatenate([frames for _, frames in fly(**SCENARIO)])
    with LogWriter(directory, attachments, LogSettings(keep_free=0, segment_size=0.2)) as log:
        sink = LogSink(log)
        for begin in range(0, len(frames), 61):
            batch = frames[begin : begin + 61]
            log.frames(batch, "socketcan:vcan0")
            for out in answered(monitor.update(batch), monitor, runner):
                _put(sink, out)
        for out in answered(monitor.finish(), monitor, runner):
            _put(sink, out)
    return directory


def _said(message):
    """All but the age of an estimate, which is that of its sending."""
    return message._replace(content={name: value for name, value in message.content.items() if name != "age"})


def _put(sink, out):
    if isinstance(out, Identified):
        sink.estimate(out, 0.01)
    elif isinstance(out, SampledEnvelope):
        sink.envelope(out)
    elif isinstance(out, Event):
        sink.event(out)


def _run(*arguments):
    return CliRunner().invoke(replay, [str(a) for a in arguments], catch_exceptions=False)


@pytest.fixture(scope="module")
def other_bundle(coarse_bundle, tmp_path_factory):
    """A bundle with another nominal envelope."""
    arrays = coarse_bundle.arrays | {"i0": coarse_bundle.i0 * 1.001}
    path = tmp_path_factory.mktemp("other") / "bundle"
    return bundles.save(path, coarse_bundle.plant, {}, arrays, builder_hash="", figures={})


@pytest.mark.parametrize("n_processes", [1, 2])
def test_with_the_same_bundle_every_estimate_is_the_same_to_the_last_bit(recorded, n_processes):
    answer = _run(recorded, "--identify", "--processes", n_processes, "--json")
    assert answer.exit_code == 0, answer.output
    found = json.loads(answer.stdout)
    assert found["same_bundle"]
    assert found["n_different"] == 0
    equal = {(m["actuator"], m["method"]): m["n_equal"] for m in found["methods"]}
    assert equal[0, "linear"] == equal[7, "linear"] == 8
    assert min(equal[0, "lf2"], equal[7, "lf2"]) >= 3


def test_a_log_of_the_new_estimates_holds_the_same_estimates_envelopes_and_events(recorded, tmp_path):
    _run(recorded, "--identify", "--out", tmp_path / "again.mcap")
    with LogReader(recorded) as before, LogReader(tmp_path / "again.mcap") as after:
        for prefix in ("/estimate", "/envelope", "/event"):
            one, two = ([m for m in log.messages(lambda t, p=prefix: t.startswith(p))] for log in (before, after))
            assert [_said(m) for m in one] == [_said(m) for m in two]
        assert after.attachments().keys() == {"daemon.yaml", "manifest-0.json", "manifest-7.json"}
    with pytest.raises(LogError, match="exists"):
        _run(recorded, "--identify", "--out", tmp_path / "again.mcap")


def test_an_estimate_that_differs_is_a_negative_answer(recorded, tmp_path, monkeypatch):
    import ema_postflight.identify as identify

    original = identify.contents.estimate

    def wrong(t_ns, actuator, cycle, result):
        content = original(t_ns, actuator, cycle, result)
        if cycle == 3 and actuator == 7 and content["method"] == "linear":
            content["k"][0] = np.nextafter(content["k"][0], 1)
        return content

    monkeypatch.setattr(identify.contents, "estimate", wrong)
    with pytest.raises(NegativeAnswer, match="1 estimates differ"):
        _run(recorded, "--identify")


def test_another_bundle_is_compared_cycle_by_cycle(recorded, other_bundle, tmp_path):
    answer = _run(recorded, "--identify", "--bundle", other_bundle.path, "--cycles", tmp_path / "c.csv")
    assert answer.exit_code == 0, answer.output
    assert "another one" in answer.output
    rows = list(csv.DictReader((tmp_path / "c.csv").read_text().splitlines()))
    linear = [row for row in rows if row["method"] == "linear"]
    assert sorted((int(row["actuator"]), int(row["cycle"])) for row in linear) == [
        (actuator, cycle) for actuator in (0, 7) for cycle in range(8)
    ]
    assert {row["equal"] for row in linear} == {"0"}
    change = [[float(row[f"k{n}_again [1]"]) - float(row[f"k{n}_logged [1]"]) for n in range(1, 7)] for row in linear]
    assert (np.abs(change).max(axis=1) > 0).all()
    assert np.abs(change).max() < 0.2


def test_a_bundle_for_one_actuator_leaves_the_other_as_it_was(recorded, other_bundle):
    found = json.loads(_run(recorded, "--identify", "--bundle", f"7={other_bundle.path}", "--json").stdout)
    methods = {(m["actuator"], m["method"]): m for m in found["methods"]}
    assert methods[0, "linear"]["n_equal"] == 8
    assert methods[7, "linear"]["n_equal"] == 0


@pytest.mark.parametrize(
    ("bundles", "said"),
    [(["7={0}", "3={0}"], "no currents of actuator 3"), (["7={0}", "7=other"], "twice"), (["{0}", "other"], "twice")],
)
def test_a_bundle_that_would_not_be_used_is_refused(recorded, other_bundle, bundles, said):
    words = [word for text in bundles for word in ("--bundle", text.format(other_bundle.path))]
    answer = _run(recorded, "--identify", *words)
    assert answer.exit_code == 2
    assert said in answer.output


def test_a_bundle_built_again_in_the_same_place_is_not_taken_for_the_old_one(
    recorded, coarse_bundle, other_bundle, tmp_path
):
    log, place = tmp_path / "log", tmp_path / "bundle"
    shutil.copytree(other_bundle.path, place)
    with LogReader(recorded) as old:
        attachments = old.attachments()
        configuration = yaml.safe_load(attachments["daemon.yaml"])
        for one in configuration["actuators"].values():
            one["bundle"] = str(place)
        log.mkdir()
        attachments["daemon.yaml"] = yaml.safe_dump(configuration).encode()
        with LogWriter(log, attachments, LogSettings(keep_free=0)) as new:
            for bus, frames in old.frames():
                new.frames(frames, bus)
    with pytest.raises(BundleError, match="has been built again"):
        _run(log, "--identify")


@pytest.mark.parametrize("suffix", ["log", "asc", "blf", "mf4"])
def test_raw_logs_of_other_tools_are_identified_as_the_daemon_did(recorded, coarse_bundle, tmp_path, suffix):
    """Only the times of frames lose digits (µs), so every linear estimate is the same to the last bit."""
    if suffix == "mf4":
        pytest.importorskip("asammdf")
    path = tmp_path / f"raw.{suffix}"
    with LogReader(recorded) as log, can.Logger(path) as target:
        for _, frames in log.frames():
            for frame in frames:
                target(message(frame, "can0"))
    with LogReader(recorded) as log:
        logged = [m.content for m in log.messages(lambda topic: topic.endswith("/linear"))]
    _run(path, "--identify", "--bundle", coarse_bundle.path, "--out", tmp_path / "again.mcap")
    with LogReader(tmp_path / "again.mcap") as log:
        again = [m.content for m in log.messages(lambda topic: topic.endswith("/linear"))]
    assert [(c["actuator"], c["cycle"], c["k"], c["sd"]) for c in again] == [
        (c["actuator"], c["cycle"], c["k"], c["sd"]) for c in logged
    ]


def test_without_asammdf_an_mf4_log_is_refused_in_one_line(recorded, tmp_path, monkeypatch):
    monkeypatch.setattr("can.io.mf4.asammdf", None)
    (tmp_path / "x.mf4").write_bytes(b"MDF     4.10")
    with pytest.raises(LogError, match=r"x\.mf4: needs a package that is not installed .*ema-monitor\[analyse\]"):
        _run(tmp_path / "x.mf4", "--identify")
    with pytest.raises(LogError, match=r"y\.mf4: .*asammdf") as error:
        CliRunner().invoke(export, [str(recorded), "--out", str(tmp_path / "y.mf4")], catch_exceptions=False)
    assert "\n" not in str(error.value)
    assert not (tmp_path / "y.mf4").exists()


def _two_channels(recorded, path):
    with LogReader(recorded) as log, can.Logger(path) as target:
        for _, frames in log.frames():
            for number, frame in enumerate(frames[:5]):
                target(message(frame, f"can{number % 2}"))
    return path


def test_what_cannot_be_done_is_said_in_one_line(recorded, coarse_bundle, tmp_path):
    _two_channels(recorded, tmp_path / "raw.log")
    with pytest.raises(LogError, match="names no bundle"):
        _run(tmp_path / "raw.log", "--identify")
    with pytest.raises(BundleError, match="is not a bundle"):
        _run(recorded, "--identify", "--bundle", tmp_path)
    raw = tmp_path / "raw.log"
    with pytest.raises(LogError, match="choose one by --channel"):  # met by the process that reads
        _run(raw, "--identify", "--bundle", coarse_bundle.path, "--processes", 2)
    with pytest.raises(LogError, match="names no bundle"):
        _run(tmp_path / "raw.log", "--identify")
    with pytest.raises(BundleError, match="is not a bundle"):
        _run(recorded, "--identify", "--bundle", tmp_path)
    assert _run(recorded).exit_code == 2
    assert _run(recorded, "--identify", "--onto", "virtual:x").exit_code == 2


def test_memory_does_not_grow_with_the_log(recorded, coarse_bundle):
    """The comparison forgets what has found its counterpart; the monitor keeps nothing of a closed cycle."""
    from ema_postflight.compare import Comparison

    comparison = Comparison()
    with LogReader(recorded) as log:
        contents = [m.content for m in log.messages(lambda topic: topic.startswith("/estimate"))]
    for day in range(3000):
        for content in contents[:5]:
            comparison.logged(content | {"t_ns": day})
            comparison.again(content | {"t_ns": day if day % 2 else -day - 1})
    assert len(comparison._open) <= 2000
    comparison.finish()
    assert comparison.n_equal == 5 * 1500
    assert comparison.n_different == 5 * 1500 * 2
