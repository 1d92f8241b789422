"""What the daemon broadcast, what it logged, and what a replay of its log finds: the same bits."""

import json
import time
from collections import deque

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from desks import loop
from ema_daemon.sinks import BusSink
from ema_daemon.worker import Worker
from ema_postflight.identify import identified, setup
from ema_postflight.replay import replay

from ema.bus import codec as codecs
from ema.bus.port import Port
from ema.core import frames as raw
from ema.core.status import Reason, Status
from ema.identification.estimate import Estimate
from ema.log import LogReader, LogWriter, Message
from ema.log.schemas import ESTIMATE
from ema.monitor import Identified, Monitor, MonitorSettings, Runner

CODEC = codecs.default()
SLOWER = {"slower": {"lf2": {"every": 2.0}, "hf": {"every": 60.0}}}


class Wire(Port):
    """A bus with recorded frames on it; keeps what is sent."""

    def __init__(self, batches=(), at_end=lambda: None):
        super().__init__("recorded")
        self.batches, self.at_end, self.sent = deque(batches), at_end, []

    def read(self, timeout):
        if not self.batches:
            self.at_end()
            return raw.empty(0)
        return self.batches.popleft()

    def write(self, frames):
        self.sent.append(frames.copy())
        return frames.size

    def close(self):
        pass


def _fly(directory, bundle, frames, run, queue=8):
    """The daemon's service on recorded frames; the estimate frames it sent."""
    directory.mkdir()
    configuration = {"actuators": {0: {"bundle": str(bundle.path)}}, "monitor": SLOWER}
    attachments = {
        "daemon.yaml": yaml.safe_dump(configuration).encode(),
        "manifest.json": json.dumps(bundle.manifest).encode(),
    }
    wire = Wire((frames[i : i + 97] for i in range(0, len(frames), 97)), lambda: service.stop())
    monitor = Monitor({0: bundle}, CODEC, MonitorSettings.model_validate(SLOWER))
    workers = {method: Worker(run, queue, method) for method in SLOWER["slower"]}
    with LogWriter(directory, attachments) as log, loop(monitor, wire, log, workers, directory) as service:
        service.run()
    others = {CODEC.messages[name].frame_id for name in ("Heartbeat", "Supervision", "Alarm")}
    return [f.tobytes() for f in np.concatenate(wire.sent) if f["id"] not in others]


def _broadcast(contents):
    """The frames that the daemon sends for logged estimates."""
    wire = Wire()
    sink = BusSink(wire, CODEC)
    for c in contents:
        k, sd = (np.array([np.nan if x is None else x for x in c[name]]) for name in ("k", "sd"))
        p_value = np.nan if c["p_value"] is None else c["p_value"]
        residual = np.array([np.nan if c["residual"] is None else c["residual"]])
        status, reasons = Status[c["status"].upper()], Reason(sum(Reason[name.upper()] for name in c["reasons"]))
        estimate = Estimate(c["method"], k, sd, np.eye(6), 0.0, 0, p_value, residual, status, reasons)
        sink.estimate(Identified(c["t_ns"], c["actuator"], c["cycle"], estimate), c["age"])
    return [f.tobytes() for batch in wire.sent for f in batch]


@pytest.fixture(scope="module")
def frames(fly):
    ramp = {"ramp": {"duration": "10 s", "initial": 0.01, "final": 0.06}}
    flight = fly(n_cycles=4, seed=5, actuators=[{"faults": {"k1": ramp, "k4": ramp}}])
    return np.concatenate([frames for _, frames in flight])


def test_frames_on_the_bus_the_log_and_both_kinds_of_replay_are_the_same_bits(coarse_bundle, frames, tmp_path):
    sent = _fly(tmp_path / "log", coarse_bundle, frames, Runner({0: coarse_bundle}).run)
    with LogReader(tmp_path / "log") as log:
        logged = [m.content for m in log.messages(lambda topic: topic.startswith("/estimate"))]
    assert [sum(c["method"] == m for c in logged) for m in ("linear", "lf2", "hf")] == [4, 2, 1]
    assert _broadcast(logged) == sent
    for n_processes in (1, 2):
        with LogReader(tmp_path / "log") as log:
            found = list(identified(log, setup(log, ()), (), n_processes))
        told = [item for item in found if isinstance(item, Message)]
        assert [item.content for item in told if item.topic.startswith("/estimate")] == logged
        again = [json.loads(item.data) for item in found if not isinstance(item, Message) and item.kind is ESTIMATE]
        for method in ("linear", "lf2", "hf"):  # on a live bus a slower one may come after the next cycle's linear one
            both = ([c | {"age": None} for c in side if c["method"] == method] for side in (again, logged))
            assert next(both) == next(both)


def test_what_a_worker_left_out_is_left_out_again(coarse_bundle, frames, tmp_path):
    runner = Runner({0: coarse_bundle})

    def slow(job):
        time.sleep(0.3)
        if job.method == "hf":
            raise RuntimeError("no memory")
        return runner.run(job)

    _fly(tmp_path / "log", coarse_bundle, frames, slow, queue=1)
    with LogReader(tmp_path / "log") as log:
        codes = [m.content["code"] for m in log.messages(lambda topic: topic == "/event")]
    assert "job_failed" in codes
    answer = CliRunner().invoke(replay, [str(tmp_path / "log"), "--identify", "--json"], catch_exceptions=False)
    assert answer.exit_code == 0, answer.output
    found = json.loads(answer.stdout)
    assert found["n_different"] == 0
    assert "hf" not in {m["method"] for m in found["methods"]}
