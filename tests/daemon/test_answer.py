"""What a worker answers is input: one that is not the answer to the job asked is an event, never an estimate."""

from __future__ import annotations

import json
import socket
import threading
from contextlib import suppress

import numpy as np
import pytest
from desks import loop
from ema_daemon.answer import pack_answer, unpack_answer
from ema_daemon.remote import RemoteRunner
from ema_daemon.wire import MAX_LINE, WireError, fingerprint
from ema_daemon.worker import Worker
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ema.bus import codec as codecs
from ema.core.status import Reason
from ema.identification import Measurement
from ema.log import LogReader, LogWriter
from ema.monitor import Job, Monitor, MonitorSettings, Runner


@pytest.fixture(scope="module")
def job(coarse_bundle):
    i_hat = 1.01 * coarse_bundle.i0[coarse_bundle.schedule]
    return Job(1_700_000_000_000_000_123, 0, 7, "lf2", Measurement.complete(i_hat, np.zeros(2)), Reason(0))


@pytest.fixture(scope="module")
def genuine(coarse_bundle, job):
    """A right answer as JSON."""
    return json.loads(pack_answer(Runner({0: coarse_bundle}).run(job), job, fingerprint(coarse_bundle)))


def test_the_right_answer_is_taken(genuine, job, coarse_bundle):
    """Or the tests below would show nothing."""
    assert unpack_answer(json.dumps(genuine).encode(), job, coarse_bundle).method == "lf2"


WRONG = {
    "another method": ({"method": "linear"}, "it is for method linear, asked was lf2"),
    "another cycle": ({"cycle": 6}, "it is for cycle"),
    "another actuator": ({"actuator": 1}, "it is for actuator"),
    "an earlier run's": ({"t_ns": 1}, "it is for t_ns"),
    "another bundle": ({"bundle": "0" * 64}, "another bundle"),
    "k infinite": ({"k": [1e999] + [0.0] * 5}, "k.0"),
    "k beyond 1": ({"k": [1.5] + [0.0] * 5}, "not within 0…1"),
    "k below 0": ({"k": [-0.1] + [0.0] * 5}, "not within 0…1"),
    "k of five": ({"k": [0.0] * 5}, r"shape \(5,\), must be \(6,\)"),
    "k a text": ({"k": "0 0 0 0 0 0"}, "k: "),
    "k of texts": ({"k": ["0"] * 6}, "k.0"),
    "k nested": ({"k": [[0.0] * 6]}, "k.0"),
    "no k but a status": ({"k": [None] * 6}, "numbers are missing"),
    "sd negative": ({"sd": [-1.0] + [0.1] * 5}, "standard deviations"),
    "covariance ragged": ({"covariance": [[0.0] * 6] * 5 + [[0.0]]}, "makes no sense"),
    "covariance not symmetric": ({"covariance": np.triu(np.ones((6, 6))).tolist()}, "covariance"),
    "residual too short": ({"residual": [0.0]}, "residual has the shape"),
    "p beyond 1": ({"p_value": 7.0}, "p_value"),
    "status unknown": ({"status": 9}, "9 is not a valid Status"),
    "status a truth": ({"status": True}, "status"),
    "reason unknown": ({"reasons": 1 << 40}, "bits that mean nothing"),
    "direction of two": ({"unseparable": [[1.0, 0.0]]}, "no direction"),
    "beside what no bundle has": (
        {"nuisance": {"names": ["x"], "units": [""], "value": [1.0], "sd": [1.0], "covariance": [], "interval95": []}},
        "not the bundle's",
    ),
    "nothing before the bounds": ({"unbounded": None}, "before the bounds is missing"),
    "before the bounds another shape": ({"unbounded": {"k": [0.0], "own": [], "shared": []}}, "another shape"),
    "before the bounds no covariance": (
        {"unbounded": {"k": [0.0] * 6, "own": [[0.0] * 6] * 6, "shared": [[0.0] * 6] * 6}},
        "covariance of its estimate before the bounds is none",
    ),
    "more than asked": ({"alarm": 1}, "alarm"),
}


@pytest.mark.parametrize(("change", "said"), WRONG.values(), ids=WRONG.keys())
def test_a_wrong_answer_is_said_in_one_line(genuine, job, coarse_bundle, change, said):
    with pytest.raises(WireError, match=said) as caught:
        unpack_answer(json.dumps(genuine | change).encode(), job, coarse_bundle)
    assert "\n" not in str(caught.value)


NUMBERS = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5)
VALUES = st.recursive(NUMBERS, lambda inner: st.lists(inner, max_size=6), max_leaves=8)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(data=st.data())
def test_an_answer_changed_anywhere_is_an_estimate_within_bounds_or_an_error(genuine, job, coarse_bundle, data):
    key = data.draw(st.sampled_from(sorted(genuine)))
    line = json.dumps(genuine | {key: data.draw(VALUES)}).encode()
    try:
        e = unpack_answer(line, job, coarse_bundle)
    except WireError:
        return
    assert e.method == job.method
    assert np.isfinite(e.k).all()
    assert ((e.k > -1e-6) & (e.k < 1 + 1e-6)).all()
    assert np.isfinite(e.covariance).all()


@given(st.binary(max_size=200) | st.dictionaries(st.text(), st.integers()).map(lambda said: json.dumps(said).encode()))
def test_arbitrary_answers_are_refused(job, coarse_bundle, line):
    with pytest.raises(WireError):
        unpack_answer(line, job, coarse_bundle)


class Liar(threading.Thread):
    """Listens like a worker, answers with the next of some lines: each job, or, if it persists, each connection."""

    def __init__(self, path, lines, persists=False):
        super().__init__(daemon=True)
        self.persists = persists
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.bind(str(path))
        self.socket.listen(1)
        self.lines = iter(lines)

    def run(self):
        for line in self.lines:
            connection, _ = self.socket.accept()
            with connection, connection.makefile("rb") as jobs:
                for _ in jobs if self.persists else [jobs.readline()]:
                    connection.sendall(line + b"\n")
        self.socket.close()


def test_the_daemon_goes_on_beside_a_worker_that_lies(genuine, coarse_bundle, fly, scripted, tmp_path):
    """Each lie is one event; nothing of it is on the bus or in the log; the linear estimates are all there."""
    changes = [{"method": "linear"}, {"k": [1e999] * 6}, {"k": "none"}, {"residual": []}]
    liar = Liar(tmp_path / "socket", [json.dumps(genuine | change).encode() for change in changes])
    liar.start()
    bundles = {0: coarse_bundle}
    remote = RemoteRunner(str(tmp_path / "socket"), bundles, timeout=20)
    monitor = Monitor(bundles, codecs.default(), MonitorSettings.model_validate({"slower": {"lf2": {"every": 0.01}}}))
    flight = [frames for _, frames in fly(n_cycles=len(changes), seed=3)]

    def answered(port):
        while not worker.idle:
            service._answer_jobs([worker])

    batches = [part for frames in flight for part in (frames, answered)]
    worker = Worker(remote.run, 8, "lf2")
    port = scripted(batches, lambda: service.stop())
    with LogWriter(tmp_path) as log, loop(monitor, port, log, {"lf2": worker}, tmp_path) as service:
        service.run()
    remote.close()
    liar.join(10)
    assert not np.isin(np.concatenate(port.written)["id"], codecs.default().messages["EstimateLf2"].frame_id).any()
    assert len(port.sent("EstimateLinear")["cycle"]) == len(changes)
    with LogReader(tmp_path) as log:
        events = [m.content for m in log.messages() if m.topic == "/event" and m.content["code"] == "job_failed"]
    assert len(events) == len(changes)
    assert all("answer" in event["text"] for event in events)


def test_what_comes_late_on_a_connection_is_not_taken_for_the_next_answer(genuine, job, coarse_bundle, tmp_path):
    """A wrong answer ends the connection: the one behind it would be a job late for ever."""
    right = json.dumps(genuine).encode()
    wrong = json.dumps(genuine | {"cycle": 6}).encode()
    liar = Liar(tmp_path / "socket", [wrong, right], persists=True)
    liar.start()
    remote = RemoteRunner(str(tmp_path / "socket"), {0: coarse_bundle}, timeout=20)
    with pytest.raises(WireError, match="cycle"):
        remote.run(job)
    assert remote.run(job).method == "lf2"
    remote.close()
    liar.join(10)


def test_a_line_without_end_is_given_up_at_a_limit(job, coarse_bundle, tmp_path):
    """Not at the time-out, until which it would fill the memory."""
    told = threading.Event()

    def pour(server):
        connection, _ = server.accept()
        with connection, suppress(OSError):
            connection.sendall(b"1" * (2 * MAX_LINE))
            told.wait(60)

    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "socket"))
        server.listen(1)
        pouring = threading.Thread(target=pour, args=(server,), daemon=True)
        pouring.start()
        remote = RemoteRunner(str(tmp_path / "socket"), {0: coarse_bundle}, timeout=10)
        with pytest.raises(WireError, match="closed the connection"):
            remote.run(job)
        told.set()
        remote.close()
        pouring.join()
