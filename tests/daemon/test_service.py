"""The loop with a scripted bus: what is sent, what is logged, what happens when something fails."""

from __future__ import annotations

import json
import re
import threading
import time

import cantools
import numpy as np
import pytest
from desks import desk
from ema_daemon.health import Health
from ema_daemon.service import Service
from ema_daemon.supervision import SupervisionSettings, promised
from ema_daemon.turn import Turn
from ema_daemon.worker import Worker
from ema_postflight.compare import Comparison
from ema_postflight.identify import Setup, identified

from ema.bus import codec as codecs
from ema.bus.protection import Receiver
from ema.core import resources
from ema.core.status import Reason, ServiceState
from ema.log import LogReader, LogWriter, Message
from ema.log.schemas import ESTIMATE
from ema.monitor import Identified, Monitor, MonitorSettings, Runner, answers
from ema.monitor.presence import Presence

CODEC = codecs.default()
WATCH = SupervisionSettings(age={"linear": 60.0, "lf2": 60.0})  # this machine may be busy with other tests
SETTINGS = MonitorSettings.model_validate({"slower": {"lf2": {"every": "2 s"}}})


class Ran:
    def __init__(self, port, reader):
        self.port = port
        self.messages = list(reader.messages())
        self.frames = np.concatenate([batch.frames for batch in reader.frames()])
        self.unfinished = reader.unfinished

    def logged(self, topic):
        return [m.content for m in self.messages if m.topic == topic]


@pytest.fixture
def run(coarse_bundle, tmp_path, scripted):
    """Runs the service on batches of frames until they end."""

    def go(batches, run_job=None, queue=8, watch=WATCH, numbers=(0,), pace=0.0):
        bundles = dict.fromkeys(numbers, coarse_bundle)
        monitor = Monitor(bundles, CODEC, SETTINGS)
        worker = Worker(run_job or Runner(bundles).run, queue, "lf2")
        port = scripted(batches, lambda: service.stop())
        turn = Turn(Presence(CODEC, monitor.actuators), port.name, 0.0, False)
        with LogWriter(tmp_path) as log, desk(bundles, port, log, tmp_path) as alarms:
            health = Health(monitor, port, log, promised(numbers, {"lf2": 2.0}, [], WATCH))
            service = Service(monitor, port, log, CODEC, {"lf2": worker}, pace, health, watch, alarms, turn)
            service.run()
        with LogReader(tmp_path) as reader:
            return Ran(port, reader)

    return go


def batches(frames, n=100):
    return [frames[i : i + n] for i in range(0, frames.size, n)]


def test_what_is_sent_is_what_is_logged_and_decodes_with_cantools(run, frames):
    ran = run(batches(frames))
    witness = cantools.database.load_file(resources.dbc())
    sent = np.concatenate(ran.port.written)
    assert (Receiver(CODEC).check(sent) == 0).all()
    for method in ("linear", "lf2"):
        message = witness.get_message_by_name(f"Estimate{method.capitalize()}")
        on_bus = [message.decode(f["data"][: f["length"]].tobytes()) for f in sent if f["id"] == message.frame_id]
        logged = ran.logged(f"/estimate/0/{method}")
        assert len(on_bus) == len(logged) == {"linear": 6, "lf2": 3}[method]
        for bus, log in zip(on_bus, logged, strict=True):
            assert bus["cycle"] == log["cycle"]
            assert str(bus["status"]) == log["status"]
            assert [bus[f"k{n}"] for n in range(1, 7)] == pytest.approx(log["k"], abs=1e-4)
            assert [bus[f"sd_k{n}"] for n in range(1, 7)] == pytest.approx(log["sd"], abs=1e-4)
            assert bus["p_value"] == pytest.approx(log["p_value"], abs=1e-4)


def test_the_log_replayed_gives_the_same_estimates_bit_for_bit(run, frames, coarse_bundle):
    ran = run(batches(frames))
    bundles = {0: coarse_bundle}
    outputs = answers(iter(batches(ran.frames, 333)), Monitor(bundles, CODEC, SETTINGS), Runner(bundles))
    again = [out for out in outputs if isinstance(out, Identified)]
    for method in ("linear", "lf2"):
        logged = ran.logged(f"/estimate/0/{method}")
        own = [o for o in again if o.estimate.method == method]
        assert [o.estimate.k.tolist() for o in own] == [content["k"] for content in logged]
        assert [o.estimate.sd.tolist() for o in own] == [content["sd"] for content in logged]
        assert [o.t_ns for o in own] == [content["t_ns"] for content in logged]


def test_everything_received_is_logged_and_the_log_is_finished(run, frames):
    ran = run(batches(frames))
    assert np.array_equal(ran.frames, frames)
    assert not ran.unfinished
    assert [c["cycle"] for c in ran.logged("/envelope/0")] == list(range(6))
    codes = [c["code"] for c in ran.logged("/event")]
    assert codes == ["started", "stopped"]


def test_near_a_cycles_end_all_that_can_wait_does(run, fly):
    """Two cycles end frame by frame in one millisecond: both are answered before a job of the first is handed on."""
    frames = fly(n_cycles=1, seed=5, actuators=[{"number": 0}, {"number": 1}])[0][1]
    ends = np.flatnonzero((frames["id"] & ~np.uint32(63 << 2)) == CODEC.messages["CycleEnd"].frame_id)
    first, last = ends[0] - 5, ends[-1] + 1
    parts = [*batches(frames[:first]), *batches(frames[first:last], 1), frames[last:]]
    answered = []

    def job(job):
        answered.append([port_of.sent("EstimateLinear")["cycle"].size, job.actuator])
        raise RuntimeError("not looked at")

    port_of = None

    def remember(port):
        nonlocal port_of
        port_of = port

    run([remember, *parts], run_job=job, numbers=(0, 1), pace=3e-3)
    assert answered == [[2, 0], [2, 1]]


def test_the_heartbeat_counts(run, frames):
    dirty = np.delete(frames, [50, 51])
    dirty["data"][200, 30] ^= 1
    ran = run(batches(dirty))
    last = ran.logged("/status")[-1]
    assert last["state"] == "stopping"
    assert last["counters"]["n_cycles"] == 6
    assert last["counters"]["n_lost"] == 3
    assert last["counters"]["n_crc_error"] == 1
    beat = ran.port.sent("Heartbeat")
    assert beat["state"][-1] == ServiceState.STOPPING
    assert (beat["n_cycles"][-1], beat["n_lost"][-1], beat["n_crc_error"][-1]) == (6, 3, 1)


def test_a_stop_in_the_middle_of_a_cycle_answers_what_there_is(run, frames):
    ran = run(batches(frames[:300]))
    (only,) = ran.logged("/estimate/0/linear")
    assert only["status"] == "invalid"
    assert {"lost_frames", "no_end"} <= set(only["reasons"])


def test_a_cycle_without_data_is_sent_without_numbers(run, frames):
    currents = np.flatnonzero(frames["id"] == CODEC.messages["PhaseCurrents"].frame_id)
    ran = run(batches(np.delete(frames, currents[:501])))
    sent = ran.port.sent("EstimateLinear")
    assert sent["status"][0] == 3
    assert (sent["sd_k"][0] > 0.9).all()
    assert ran.logged("/estimate/0/linear")[0]["k"] == [None] * 6


def test_jobs_beyond_the_queue_are_skipped_and_said(run, frames):
    gate = threading.Event()

    def stuck(job):
        gate.wait(10)
        raise RuntimeError("no answer")

    def open_gate(port):
        gate.set()

    ran = run([*batches(frames), open_gate], stuck, queue=1)
    codes = [c["code"] for c in ran.logged("/event")]
    assert codes.count("job_skipped") == 1
    assert codes.count("job_failed") == 2
    assert len(ran.logged("/estimate/0/linear")) == 6
    assert ran.logged("/status")[-1]["counters"]["n_skipped"] == 1


def test_what_the_kernel_drops_is_in_the_log_where_it_happened(run, frames):
    def drop(port):
        port.counters.kernel_drops += 100

    ran = run([*batches(frames[:1500]), drop, *batches(frames[1600:])])
    reasons = {c["cycle"]: c["reasons"] for c in ran.logged("/estimate/0/linear")}
    assert [n for n, names in reasons.items() if "kernel_drops" in names] == [2]
    assert ran.frames.size == frames.size - 100 + 1
    assert ran.port.sent("Heartbeat")["kernel_drops"][-1] == 100


def test_doubt_is_the_same_live_and_replayed(run, fly, coarse_bundle):
    """LF2 says whether the model is doubted; it is slow here, and the frames come much faster than real ones."""
    bundles = {0: coarse_bundle}
    runner = Runner(bundles)

    def slow(job):
        time.sleep(0.05)
        return runner.run(job)

    odd = {"n_cycles": 6, "seed": 5, "actuators": [{"effects": {"viscous_drag": {"coefficient": 2e-4}}}]}
    frames = np.concatenate([frames for _, frames in fly(**odd)])
    ran = run(batches(frames), slow)
    outputs = answers(iter(batches(frames)), Monitor(bundles, CODEC, SETTINGS), runner)
    again = [out for out in outputs if isinstance(out, Identified)]
    for method in ("linear", "lf2"):
        logged = [(c["cycle"], c["status"], c["reasons"]) for c in ran.logged(f"/estimate/0/{method}")]
        own = [(o.cycle, o.estimate.status.name.lower(), o.estimate.reasons.names) for o in again
               if o.estimate.method == method]  # fmt: skip
        assert logged == own
    assert "model_in_doubt" in ran.logged("/estimate/0/linear")[-1]["reasons"]


@pytest.mark.parametrize("late", [("linear",), ("linear", "lf2")])
def test_late_estimates_are_marked_and_a_replay_repeats_it(run, frames, coarse_bundle, tmp_path, late):
    """The clock decides live; what it decided is in the log, and a replay has no clock."""
    watch = SupervisionSettings(age=WATCH.age | dict.fromkeys(late, 1e-9))
    ran = run(batches(frames), watch=watch)
    for method in ("linear", "lf2"):
        for content in ran.logged(f"/estimate/0/{method}"):
            assert ("late" in content["reasons"]) == (method in late)
            assert content["status"] == ("degraded" if method in late else "valid")
            assert 0 < content["age"] < 60
    codes = [c["code"] for c in ran.logged("/event")]
    assert codes.count("late") == 6 + 3 * ("lf2" in late)
    comparison = Comparison()
    with LogReader(tmp_path) as log:
        for item in identified(log, Setup({0: coarse_bundle}, SETTINGS, True), n_processes=1):
            if isinstance(item, Message):
                if item.topic.startswith("/estimate"):
                    comparison.logged(item.content)
            elif item.kind is ESTIMATE:
                comparison.again(json.loads(item.data))
    comparison.finish()
    assert (comparison.n_equal, comparison.n_different) == (9, 0)
    sent = ran.port.sent("EstimateLinear")
    assert (sent["reason"] & Reason.LATE != 0).all()
    assert sent["age"] == pytest.approx([c["age"] for c in ran.logged("/estimate/0/linear")], abs=1e-6)


def test_every_path_of_the_shipped_layout_is_in_a_log_as_a_number(run, frames):
    """Foxglove shows an empty panel where a topic or field is not there, or is no number."""
    ran = run(batches(frames))
    layout = json.loads(resources.config("foxglove-layout.json").read_text())
    plots = [path["value"] for panel in layout["configById"].values() for path in panel.get("paths", [])]
    raw = [panel["topicPath"] for panel in layout["configById"].values() if "topicPath" in panel]
    assert len(plots) > 15
    for path in plots:
        topic, _, names = path.partition(".")
        value = ran.logged(topic)[0]
        for name, index in re.findall(r"(\w+)(?:\[(\d+)\])?", names):
            value = value[name][int(index)] if index else value[name]
        assert isinstance(value, float | int), path
    for topic in raw:
        assert ran.logged(topic), topic
