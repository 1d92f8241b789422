"""Somebody who knows the DBC forges currents with the right CRC and number: with a key, no estimate changes."""

import threading
import time

import numpy as np
import pytest
from e2e.p05 import e2e_p05_protect
from ema_daemon.assembly import assembled
from ema_daemon.settings import load
from ema_simulator.node import run
from ema_simulator.scenario import Scenario
from sealed_bus import acquainted

from ema.bus import codec as codecs
from ema.bus import identifiers
from ema.bus.header import sequence
from ema.bus.interface import BusSettings, elsewhere, open_bus
from ema.bus.protection import Sender
from ema.core import frames as fr
from ema.core.status import Reason, Status
from ema.log import LogReader, LogWriter
from ema.monitor import Identified, Monitor
from ema.monitor.settings import MonitorSettings

CODEC = codecs.default()
CURRENTS = CODEC.messages["PhaseCurrents"].frame_id


@pytest.fixture
def estimates(coarse_bundle):
    def of(frames):
        monitor = Monitor({0: coarse_bundle}, CODEC, MonitorSettings.model_validate({"slower": {}}))
        outputs = [*monitor.update(frames), *monitor.finish()]
        return [o.estimate for o in outputs if isinstance(o, Identified)], monitor.counts

    return of


def with_forged(frames):
    """Before every tenth frame of currents, another one in its place: all currents half as large."""
    out = []
    for n in range(frames.size):
        frame = frames[n : n + 1]
        if frame["id"][0] == CURRENTS and sequence(frame)[0] % 10 == 0:
            forged = frame.copy()
            forged["data"][0, 4:] = (frame["data"][0, 4:].copy().view(">i2") // 2).view(np.uint8)
            payload = forged["data"][0, :64].copy()
            e2e_p05_protect(payload.data, identifiers.data_id(CURRENTS), increment_counter=False)
            forged["data"][0] = payload
            out.append(forged)
        out.append(frame)
    return np.concatenate(out)


@pytest.fixture
def ends(frames, tmp_path):
    return acquainted(CODEC, frames[-1:], tmp_path)


def with_seals(frames, ends):
    sealer, out = ends[0], []
    for n in range(frames.size):
        seals = sealer.add(frames[n : n + 1])
        seals["t_ns"] = frames["t_ns"][n]
        out += [frames[n : n + 1], seals]
    return np.concatenate(out)


def let_through(frames, ends):
    verifier = ends[1]
    parts = [verifier.feed(part, int(part["t_ns"][-1])) for part in np.array_split(frames, 200)]
    return np.concatenate([*parts, verifier.feed(fr.empty(0), 2**63)])


def k(estimates):
    return np.array([estimate.k for estimate in estimates])


def test_forged_currents_change_no_estimate_but_each_says_that_there_were_some(frames, estimates, ends):
    true, _ = estimates(frames)
    found, counts = estimates(let_through(with_forged(with_seals(frames, ends)), ends))
    assert counts.n_refused == with_forged(frames).size - frames.size > 250
    assert counts.n_lost == 0
    assert np.array_equal(k(found), k(true))
    assert all(e.reasons == t.reasons | Reason.AUTHENTICATION for e, t in zip(found, true, strict=True))
    assert all(e.status == max(t.status, Status.DEGRADED) for e, t in zip(found, true, strict=True))


def test_refused_frames_are_evidence_in_the_log_and_replay_gives_the_same(frames, estimates, ends, tmp_path):
    passed = let_through(with_forged(with_seals(frames, ends)), ends)
    with LogWriter(tmp_path) as log:
        log.frames(passed, "vcan0")
    with LogReader(tmp_path) as log:
        logged = np.concatenate([part for _, part in log.frames()])
    assert np.array_equal(logged, passed)
    (live, n_live), (again, n_again) = estimates(passed), estimates(logged)
    assert np.array_equal(k(live), k(again))
    assert [e.reasons for e in live] == [e.reasons for e in again]
    assert n_live == n_again


def test_an_undisturbed_sealed_bus_says_nothing_of_it(frames, estimates, ends):
    found, counts = estimates(let_through(with_seals(frames, ends), ends))
    assert counts.n_refused == 0
    assert not any(e.reasons & Reason.AUTHENTICATION for e in found)


def test_without_a_key_forged_frames_are_taken(frames, estimates):
    """Or the tests above would show nothing."""
    assert not np.allclose(k(estimates(with_forged(frames))[0]), k(estimates(frames)[0]), atol=0.01)


def test_another_bus_on_the_command_line_keeps_the_key(write_config, tmp_path):
    """The service is started with `--bus vcan0`: its key must not be forgotten by that."""
    settings = load(
        write_config(
            bus={"interface": "socketcan", "key_file": "key", "session_file": "s", "options": {"receive_buffer": 9}}
        )
    )
    assert settings.bus.key_file == tmp_path / "key"
    same, other = elsewhere(settings.bus, "can1"), elsewhere(settings.bus, "virtual:x")
    assert same.session_file == tmp_path / "s"
    assert (same.channel, same.key_file, same.options) == ("can1", tmp_path / "key", {"receive_buffer": 9})
    assert (other.interface, other.key_file, other.options) == ("virtual", tmp_path / "key", {})


def test_a_daemon_an_actuator_and_a_listener_with_keys(write_config, shipped_plant, tmp_path):
    """End to end: each asks whom it does not know, is answered, and goes on; without the key nothing is heard."""
    key = tmp_path / "key"
    key.write_text("5a" * 16)
    key.chmod(0o600)
    place = {"interface": "virtual", "channel": "locked"}
    settings = load(write_config(bus=place | {"key_file": "key"}, monitor={"slower": {}}))
    scenario = Scenario.model_validate({"seed": 3, "period": 1.0, "actuators": [{"number": 0}]})
    stop = threading.Event()
    found: dict[str, list[int]] = {"with": [], "without": []}

    def heard(port, actuator):
        frames = port.read(0.02)
        frame_id = identifiers.with_actuator(CODEC.messages["EstimateLinear"].frame_id, actuator)
        return frames["flags"][frames["id"] == frame_id].tolist()

    with open_bus(BusSettings(**place)) as outside, open_bus(settings.bus) as listener, assembled(settings) as service:
        actuators = open_bus(settings.bus, CODEC.filters("Tester"), "Actuator")
        node = threading.Thread(target=run, args=(scenario, shipped_plant, actuators, CODEC, stop))
        daemon = threading.Thread(target=service.run)
        daemon.start()
        node.start()
        end = time.monotonic() + 60
        while time.monotonic() < end and not any(not f & fr.FrameFlag.REFUSED for f in found["with"]):
            found["with"] += heard(listener, 0)
        stop.set()
        node.join(20)
        service.stop()
        daemon.join(20)
        actuators.close()
        forged = CODEC.encode("EstimateLinear", 5, estimate_values())
        outside.write(Sender().protect(forged))
        end = time.monotonic() + 5
        while time.monotonic() < end and not found["without"]:
            found["without"] += heard(listener, 5)
    assert any(not f & fr.FrameFlag.REFUSED for f in found["with"])
    assert [bool(f & fr.FrameFlag.REFUSED) for f in found["without"]] == [True]


def estimate_values():
    return {name: np.zeros((1, field.n_values)) if field.n_values else 0
            for name, field in CODEC.messages["EstimateLinear"].fields.items()}  # fmt: skip
