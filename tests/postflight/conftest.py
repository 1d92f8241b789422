"""A log of two actuators: frames as a drive sends them, estimates, envelopes, events and status."""

import numpy as np
import pytest

from ema.bus import codec as codecs
from ema.bus.protection import Sender
from ema.core import resources
from ema.core.status import LogState, Reason, ServiceState, Status
from ema.identification.estimate import Estimate
from ema.log import LogSettings, contents, schemas
from ema.log.segmented import SegmentedLog

T0 = 1_741_943_700_000_000_000  # 2025-03-14 09:15:00 UTC
N_CYCLES = 12


def cycle_frames(codec, sender, rng, actuator, cycle, t_ns):
    """Some frames of one test cycle: start, five of currents, end."""
    first = sender.next_sequence(int(codec.messages["PhaseCurrents"].frame_id) | actuator << 2)
    place = {"cycle": cycle, "first_current": first, "first_motion": 0, "n_samples": 50, "period": 1e-4}
    place["motion_kind"] = 0
    currents = {name: rng.uniform(-20, 20, (5, 10)) for name in ("i_a", "i_b", "i_c")}
    parts = [
        codec.encode("CycleStart", actuator, place, t_ns),
        codec.encode("PhaseCurrents", actuator, currents, t_ns + 1_000_000 * (1 + np.arange(5))),
        codec.encode("CycleEnd", actuator, place, t_ns + 7_000_000),
    ]
    return sender.protect(np.concatenate(parts))


def estimate(rng, actuator, cycle):
    """A fault k1 that grows on actuator 0; one doubtful cycle."""
    k = np.abs(rng.normal(0.01, 0.005, 6))
    if actuator == 0:
        k[0] = 0.05 + 0.02 * cycle + rng.normal(0, 0.005)
    doubtful = cycle == 5
    status = Status.DEGRADED if doubtful else Status.VALID
    reasons = Reason.LOST_FRAMES if doubtful else Reason(0)
    return Estimate("linear", k, np.full(6, 0.01), np.eye(6), 20.0, 24, 0.4, rng.normal(0, 0.01, 30), status, reasons)


@pytest.fixture(scope="session")
def flight(tmp_path_factory):
    """Directory of the log: several finished segments."""
    directory = tmp_path_factory.mktemp("flight")
    codec, sender, rng = codecs.default(), Sender(), np.random.default_rng(7)
    attachments = {"ema.dbc": resources.dbc().read_bytes(), "manifest.json": b'{"software": "0.1.0"}'}
    settings = LogSettings(keep_free=0, segment_time=4)
    log = SegmentedLog(directory, attachments, settings, T0, 0.0, metadata={"software": "0.1.0"})
    for cycle in range(N_CYCLES):
        t_ns = T0 + cycle * 10**9
        for actuator in (0, 3):
            log.frames(cycle_frames(codec, sender, rng, actuator, cycle, t_ns), "vcan0")
            result = estimate(rng, actuator, cycle)
            log.write(schemas.ESTIMATE.encode(contents.estimate(t_ns + 10**7, actuator, cycle, result)))
            t = np.linspace(0.05, 0.45, 30)
            model = 5 + np.sin(20 * t)
            envelope = contents.envelope(
                t_ns + 10**7, actuator, cycle, t, model + result.residual, model, np.full(30, 0.01)
            )
            log.write(schemas.ENVELOPE.encode(envelope))
        counters = {"n_cycles": 2 * cycle + 2, "n_lost": int(cycle >= 5), "n_crc_error": 0}
        status = contents.status(t_ns, ServiceState.RUNNING, float(cycle), LogState.OK, 5e9, counters)
        log.write(schemas.STATUS.encode(status))
        if cycle == 5:
            event = contents.event(t_ns, "warning", "lost_frames", "one frame lost", 0)
            log.write(schemas.EVENT.encode(event))
        log.tick(t_ns, float(cycle + 1))
    log.close()
    assert len(list(directory.glob("*.mcap"))) > 2
    return directory


@pytest.fixture(scope="session")
def faulty_flight(tmp_path_factory):
    """Twelve cycles of a growing k1: linear in each, LF2 in three of them; alarms as the daemon logs them."""
    directory = tmp_path_factory.mktemp("faulty")
    log = SegmentedLog(directory, {}, LogSettings(keep_free=0), T0, 0.0)
    for cycle in range(12):
        k = np.array([0.02 + 0.08 * cycle / 12, 0, 0, 0, 0, 0])
        for method in ("linear", "lf2") if cycle % 5 == 0 else ("linear",):
            t_ns, nothing = T0 + cycle * 10**9, Reason(0)
            made = Estimate(method, k, np.full(6, 0.003), np.eye(6), 20.0, 24, 0.4, np.zeros(30), Status.VALID, nothing)
            log.write(schemas.ESTIMATE.encode(contents.estimate(t_ns, 0, cycle, made)))
    log.close()
    return directory


@pytest.fixture
def frame():
    """Protected frames as the daemon sends them."""
    codec, sender = codecs.default(), Sender()

    def make(name, actuator=0, t_ns=1_741_943_700_000_000_000, **values):
        fields = codec.messages[name].fields
        zero = {key: np.zeros((1, f.n_values)) if f.n_values else 0 for key, f in fields.items()}
        return sender.protect(codec.encode(name, actuator, zero | values, t_ns))

    return make
