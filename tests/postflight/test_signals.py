"""`ema export --signals`: what the readers of other tools see is what the log holds."""

import json

import numpy as np
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner
from ema_daemon.sinks import LogSink
from ema_postflight.export import export
from ema_postflight.numeric_files import McapSeries
from mcap.reader import make_reader

from ema.bus import codec as codecs
from ema.core import resources
from ema.core.errors import LogError
from ema.log import LogReader, LogSettings, LogWriter, contents
from ema.monitor import Identified, Monitor, MonitorSettings, SampledEnvelope
from ema.monitor.recorded import cycles

NUMBER = 5


@pytest.fixture(scope="module")
def log(coarse_bundle, fly, tmp_path_factory):
    """A log as the daemon writes it, of one actuator."""
    directory = tmp_path_factory.mktemp("signals")
    flight = fly(n_cycles=3, seed=3, actuators=[{"number": NUMBER, "faults": {"k1": 0.1}}])
    monitor = Monitor({NUMBER: coarse_bundle}, codecs.default(), MonitorSettings())
    attached = {"ema.dbc": resources.dbc(), "manifest.json": json.dumps(coarse_bundle.manifest).encode()}
    with LogWriter(directory, attached, LogSettings(keep_free=0)) as writer:
        sink = LogSink(writer)
        for _, frames in flight:
            writer.frames(frames, "vcan0")
            for out in monitor.update(frames):
                if isinstance(out, Identified):
                    sink.estimate(out, 0.01)
                elif isinstance(out, SampledEnvelope):
                    sink.envelope(out)
        writer.status(contents.status(int(frames["t_ns"][-1]), *_STATUS))
    return directory


def _status():
    from ema.core.status import LogState, ServiceState

    return ServiceState.DEGRADED, 3.0, LogState.OK, 1e9, {"n_lost": 2}


_STATUS = _status()


def _export(log, out, *more):
    answer = CliRunner().invoke(export, [str(log), "--signals", "--out", str(out), *more], catch_exceptions=False)
    assert answer.exit_code == 0, answer.output
    return answer.output


def _mcap(out):
    """Topic → times and fields, as any MCAP reader with JSON sees them."""
    found = {}
    with out.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            assert schema.encoding == "jsonschema"
            assert channel.message_encoding == "json"
            found.setdefault(channel.topic, []).append((message.log_time, json.loads(message.data)))
    return found


def test_mcap_holds_currents_as_numbers_sample_by_sample(log, tmp_path):
    directory = log
    said = _export(directory, tmp_path / "s.mcap")
    found = _mcap(tmp_path / "s.mcap")
    rows = found[f"/signals/currents/{NUMBER}"]
    with LogReader(directory) as back:
        true = np.concatenate([cycle["i_a"] for _, cycle in cycles(back)])
    assert np.array_equal([one["i_a"] for _, one in rows], true)
    assert f"{len(true)} samples of currents/{NUMBER}" in said
    t = np.array([t_ns for t_ns, _ in rows])
    assert (np.diff(t) >= 0).all()
    assert np.median(np.diff(t)) == 100_000  # 10 kHz
    assert np.quantile(np.diff(t), [0.01, 0.99]) == pytest.approx(100_000, abs=2)
    for one in (value for _, value in rows):
        assert all(isinstance(x, float) for x in one.values())


def test_estimates_carry_intervals_and_states_are_numbers(log, tmp_path):
    directory = log
    _export(directory, tmp_path / "s.mcap")
    found = _mcap(tmp_path / "s.mcap")
    for _, one in found[f"/signals/estimate/{NUMBER}/linear"]:
        for k in ("k1", "k6"):
            assert 0 <= one[f"low_{k}"] <= one[k] <= one[f"high_{k}"] <= 1
        assert one["status"] in (0, 1)
    ((_, status),) = found["/signals/status"]
    assert (status["state"], status["log_state"], status["n_lost"]) == (2, 0, 2)
    assert len(found[f"/signals/envelope/{NUMBER}"]) == 90
    assert {"theta_u", "theta_m", "theta_cmd"} == set(found[f"/signals/motion/{NUMBER}"][0][1])


def test_mf4_by_asammdf_and_parquet_by_pyarrow_hold_the_same(log, tmp_path):
    asammdf = pytest.importorskip("asammdf")
    directory = log
    _export(directory, tmp_path / "s.mcap")
    _export(directory, tmp_path / "s.mf4")
    _export(directory, tmp_path / "tables", "--format", "parquet")
    rows = _mcap(tmp_path / "s.mcap")[f"/signals/currents/{NUMBER}"]
    i_b = np.array([one["i_b"] for _, one in rows])
    with asammdf.MDF(tmp_path / "s.mf4") as mdf:
        signal = mdf.get(f"currents/{NUMBER}.i_b")
        assert signal.unit == "A"
        assert np.array_equal(signal.samples, i_b)
        t = np.array([t_ns for t_ns, _ in rows])
        assert np.abs(np.diff(signal.timestamps) - np.diff(t) / 1e9).max() < 1e-9
        assert len(mdf.get(f"estimate/{NUMBER}/linear.low_k1").samples) == 3
    table = pq.read_table(tmp_path / "tables" / f"currents-{NUMBER}.parquet")
    assert np.array_equal(table["i_b [A]"].to_numpy(), i_b)
    assert table.schema.field("i_b [A]").metadata == {b"unit": b"A"}
    assert table["t_ns [ns]"].to_pylist() == [t_ns for t_ns, _ in rows]


def test_a_file_that_holds_less_than_was_written_is_no_success(log, tmp_path, monkeypatch):
    directory = log
    write = McapSeries._write
    monkeypatch.setattr(McapSeries, "_write", lambda self, s: write(self, s) if s.channel != "status" else None)
    answer = CliRunner().invoke(export, [str(directory), "--signals", "--out", str(tmp_path / "s.mcap")])
    assert isinstance(answer.exception, LogError)
    assert "holds 0 of 1 samples of status" in str(answer.exception)


def test_the_shipped_layouts_show_what_there_is(log, tmp_path):
    """Every topic and path of the signals' layout is in such a file, as a number."""
    directory = log
    _export(directory, tmp_path / "s.mcap")
    found = _mcap(tmp_path / "s.mcap")
    layout = json.loads(resources.config("foxglove-signals.json").read_text())
    paths = [path["value"] for panel in layout["configById"].values() for path in panel["paths"]]
    assert len(paths) > 15
    for path in paths:
        topic, _, name = path.partition(".")
        rows = found[topic.replace("/0", f"/{NUMBER}")]
        assert isinstance(rows[0][1][name], float | int), path
