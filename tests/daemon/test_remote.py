"""A worker process: what crosses the socket is what was sent, and whatever goes wrong is one answer."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from ema_daemon import answer as answers
from ema_daemon import wire
from ema_daemon.answer import pack_answer, unpack_answer
from ema_daemon.remote import RemoteRunner
from ema_daemon.settings import load
from ema_daemon.wire import WireError
from ema_daemon.worker_process import Server
from hypothesis import given
from hypothesis import strategies as st

from ema.core.errors import BusError, ConfigError
from ema.core.status import Reason
from ema.identification import Measurement
from ema.models import hf
from ema.monitor import Job, Runner

EMA = Path(sys.executable).with_name("ema")


@pytest.fixture
def job(coarse_bundle, shipped_plant):
    response = hf.simulate(shipped_plant, np.array([0.04, 0, 0, 0.05, 0, 0]), seeds=8)
    i_hat = response.envelope[0, coarse_bundle.schedule]
    measurement = Measurement(i_hat, np.zeros(2), np.ones(i_hat.size, bool))
    return Job(1_700_000_000_000_000_123, 0, 7, "lf2", measurement, Reason(0))


@pytest.fixture
def served(coarse_bundle, tmp_path):
    stop, path = threading.Event(), tmp_path / "socket"
    server = Server(path, {0: coarse_bundle})
    thread = threading.Thread(target=server.run, args=(stop,))
    thread.start()
    yield path
    stop.set()
    thread.join(10)
    assert not path.exists()


def assert_same(answer, estimate):
    """Every field but those that intervals are made from."""
    np.testing.assert_equal(asdict(answer), asdict(replace(estimate, marginals=None, edges=None)))


@pytest.fixture
def connect(coarse_bundle):
    """Makes the daemon's side for actuators 0 and 5."""
    made = []

    def make(path):
        made.append(RemoteRunner(str(path), {0: coarse_bundle, 5: coarse_bundle}))
        return made[-1]

    yield make
    for runner in made:
        runner.close()


def test_the_answer_is_that_of_this_process_bit_for_bit(served, connect, coarse_bundle, job):
    remote, local = connect(served), Runner({0: coarse_bundle})
    for one in (job, replace(job, method="linear")):
        assert_same(remote.run(one), local.run(one))
    measurement = replace(job.measurement, start=None, valid=np.arange(job.measurement.i_hat.size) > 3)
    gaps = replace(job, measurement=measurement)
    assert_same(remote.run(gaps), local.run(gaps))


def test_what_cannot_be_told_apart_crosses_as_well(coarse_bundle, job):
    rng = np.random.default_rng(1)
    directions = rng.standard_normal((2, 6))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    estimate = replace(Runner({0: coarse_bundle}).run(job), unseparable=tuple(directions))
    line = pack_answer(estimate, job, wire.fingerprint(coarse_bundle))
    assert_same(unpack_answer(line, job, coarse_bundle), estimate)


def test_nothing_measured_crosses_as_well(served, connect, job):
    n = job.measurement.i_hat.size
    nothing = replace(job, measurement=Measurement(np.full(n, np.nan), None, np.zeros(n, bool)))
    answer = connect(served).run(nothing)
    assert np.isnan(answer.k).all()
    assert np.isnan(answer.p_value)


def test_errors_are_answers_and_the_worker_goes_on(served, connect, job):
    remote = connect(served)
    with pytest.raises(WireError, match="identifier 'magic' is unknown"):
        remote.run(replace(job, method="magic"))
    with pytest.raises(WireError, match="another bundle for actuator 5"):
        remote.run(replace(job, actuator=5))
    assert remote.run(job).k.shape == (6,)


def test_a_worker_that_is_not_there_and_then_is(tmp_path, connect, coarse_bundle, job):
    remote = connect(tmp_path / "socket")
    with pytest.raises(WireError, match="does not answer"):
        remote.run(job)
    for _ in range(2):  # restarted once
        stop = threading.Event()
        server = Server(tmp_path / "socket", {0: coarse_bundle})
        thread = threading.Thread(target=server.run, args=(stop,))
        thread.start()
        assert remote.run(job).method == "lf2"
        stop.set()
        thread.join(10)


def test_a_process_that_takes_connections_and_never_answers_gives_no_sign_of_life(tmp_path, connect):
    with socket.socket(socket.AF_UNIX) as stopped:
        stopped.bind(str(tmp_path / "socket"))
        stopped.listen()
        remote = connect(tmp_path / "socket")
        assert remote.answers()
        remote.watch()
        end = time.monotonic() + 30
        while remote.answers() and time.monotonic() < end:
            time.sleep(0.05)
        assert not remote.answers()


def test_a_socket_somebody_listens_on_is_not_taken(served, coarse_bundle):
    with pytest.raises(BusError, match="cannot be made"):
        Server(served, {0: coarse_bundle})


def test_whatever_is_said_to_the_worker_gets_one_answer(served):
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as sock, sock.makefile("rb") as answers:
        sock.settimeout(20)
        sock.connect(str(served))
        for line in (b"", b"{}", b"[1]", b"\xff\xfe", b'{"i_hat": 3, "start": [], "valid": 0}', b"[" * 5000):
            sock.sendall(line + b"\n")
            assert "error" in json.loads(answers.readline())


def test_a_daemon_that_does_not_read_its_answer_does_not_keep_the_worker_from_stopping(
    coarse_bundle, tmp_path, monkeypatch
):
    stop, answered = threading.Event(), threading.Event()

    def long_answer(answer):
        answered.set()
        return bytes(1 << 24)

    monkeypatch.setattr(answers, "pack_error", long_answer)
    thread = threading.Thread(target=Server(tmp_path / "socket", {0: coarse_bundle}).run, args=(stop,))
    thread.start()
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as sock:
        sock.connect(str(tmp_path / "socket"))
        sock.sendall(b"\n")
        assert answered.wait(10)
        stop.set()
        thread.join(10)
        assert not thread.is_alive()


ANYTHING = st.dictionaries(st.text(), st.integers()).map(lambda said: json.dumps(said).encode())


@given(st.binary(max_size=200) | st.text().map(str.encode) | ANYTHING)
def test_arbitrary_jobs_are_refused(line):
    with pytest.raises(WireError):
        wire.unpack_job(line)


def test_hf_is_not_run_in_the_daemon(write_config):
    with pytest.raises(ConfigError, match=r"identifier 'hf' needs a process of its own: remote\.hf is its socket"):
        load(write_config(monitor={"slower": {"hf": {"every": 60}}}))


@pytest.mark.slow
def test_the_command_answers_hf_jobs_until_it_is_stopped(write_config, connect, job, tmp_path):
    config = write_config(monitor={"slower": {"hf": {"every": 60}}}, remote={"hf": "hf.sock"})
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(tmp_path / "notify"))
        manager.settimeout(120)
        environment = {**os.environ, "NOTIFY_SOCKET": str(tmp_path / "notify")}
        process = subprocess.Popen([EMA, "hf-worker", "--config", config], env=environment)
        try:
            assert manager.recv(100) == b"READY=1"
            answer = connect(load(config).remote["hf"]).run(replace(job, method="hf"))
            assert np.abs(answer.k - [0.04, 0, 0, 0.05, 0, 0]).max() < 0.02
            process.send_signal(signal.SIGTERM)
            assert process.wait(30) == 0
        finally:
            process.kill()
            process.wait()
    assert not (tmp_path / "hf.sock").exists()
