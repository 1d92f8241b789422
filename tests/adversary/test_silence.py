"""What is not heard is said, with its reason, and RUNNING comes back by itself."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import threading
from contextlib import suppress

import numpy as np
import pytest
from attacked import EMA, PATIENCE, of, reasons, sealed, statuses

from ema.bus import codec as codecs
from ema.core.status import Lapse, Reason, ServiceState, Status

CODEC = codecs.default()


def without(*names):
    return lambda frames: frames[~np.logical_or.reduce([of(frames, name) for name in names])]


def with_channel(name, value):
    """Currents of one phase, always the same."""

    def change(frames):
        own = of(frames, "PhaseCurrents")
        if own.any():
            part = frames[own]
            field = CODEC.messages["PhaseCurrents"].fields[name]
            field.view(part)[...] = round(value / field.scale)
            frames[own] = sealed(part)
        return frames

    return change


def noted(daemon, code):
    """Stops it; how many events of this code its log has."""
    assert daemon.stop() == 0
    return sum(event["code"] == code for event in daemon.events())


SILENCES = {
    "nothing": (lambda frames: frames[:0], Lapse.SILENT),
    "no cycle markers": (without("CycleStart", "CycleEnd"), Lapse.NO_CYCLES),
    "no currents": (without("PhaseCurrents"), Lapse.NO_CURRENTS),
    "no positions": (without("Motion"), Lapse.NO_MOTION),
    "no supply": (without("Supply"), Lapse.NO_SUPPLY),
}


@pytest.mark.parametrize("name", SILENCES)
def test_an_actuator_falls_silent_in_part(attack, tell, name):
    change, lapse = SILENCES[name]
    daemon = attack(supervision={"cycle": "1.5 s"})
    daemon.until_state(ServiceState.RUNNING)
    daemon.actuator.change = change
    late = daemon.until_state(ServiceState.DEGRADED, lapse)
    daemon.actuator.change = lambda frames: frames
    again = daemon.until_state(ServiceState.RUNNING)
    assert noted(daemon, lapse.name.lower()) == 1
    tell(
        f"an actuator sends {name} any more",
        1,
        f"degraded, `{lapse.name.lower()}`, after {late:.1f} s, one event; running {again:.1f} s after it is back",
        "what was not sent",
    )


def test_a_sensor_is_dead(attack, tell):
    daemon = attack(supervision={"cycle": "1.5 s"})
    daemon.until_state(ServiceState.RUNNING)
    daemon.actuator.change = with_channel("i_a", 0.0)
    late = daemon.until_state(ServiceState.DEGRADED, Lapse.CHANNEL)
    (last,) = daemon.estimates(1)
    assert statuses([last]) == [Status.INVALID]
    assert reasons(last) & (Reason.CURRENT_A | Reason.CURRENT_SUM)
    daemon.actuator.change = lambda frames: frames
    daemon.until_state(ServiceState.RUNNING)
    named = ", ".join(reasons(last).names)
    tell("one phase's current reads zero", 1, f"invalid, `{named}`; degraded, `channel`, after {late:.1f} s", "nothing")


def test_never_heard_at_all(attack, tell):
    daemon = attack()
    daemon.actuator.pause()
    late = daemon.until_state(ServiceState.DEGRADED, Lapse.SILENT)
    tell("a second of an actuator, then never again", 1, f"degraded, `silent`, after {late:.1f} s", "nothing")


def test_no_worker_for_hf(attack, tell, tmp_path):
    daemon = attack(monitor={"slower": {"hf": {"every": "2 s"}}}, remote={"hf": str(tmp_path / "nobody.sock")})
    late = daemon.until_state(ServiceState.DEGRADED, Lapse.WORKER)
    daemon.estimates(1)  # of a cycle that had begun before the daemon
    assert set(statuses(daemon.estimates(2))) == {Status.VALID}
    tell("no HF worker where one is configured", 1, f"degraded, `worker`, after {late:.1f} s; linear as before", "hf")


def test_the_hf_worker_hangs(attack, tell, tmp_path):
    """A real one, stopped by a signal, as by a debugger or a device that does not answer."""
    path = tmp_path / "hf.sock"
    hf = {"monitor": {"slower": {"hf": {"every": "1 s"}}}, "remote": {"hf": str(path)}}
    daemon = attack(**hf)  # a slow machine needs longer than that for one, and is asked for the newest cycle next
    with subprocess.Popen([EMA, "hf-worker", "--config", daemon.config], stderr=subprocess.DEVNULL) as worker:
        try:
            daemon.until(lambda one: one.name == "EstimateHf")
            daemon.until_state(ServiceState.RUNNING)
            worker.send_signal(signal.SIGSTOP)
            late = daemon.until_state(ServiceState.DEGRADED, Lapse.WORKER)
            assert set(statuses(daemon.estimates(2))) == {Status.VALID}
            worker.send_signal(signal.SIGCONT)
            again = daemon.until_state(ServiceState.RUNNING)
            daemon.estimates(1, "Hf")
            assert daemon.stop() == 0
        finally:
            worker.send_signal(signal.SIGCONT)
            worker.terminate()
            worker.wait(PATIENCE)
    tell("SIGSTOP of the HF worker, with a job or without", 1,
         f"degraded, `worker`, after {late:.1f} s; linear as before; running {again:.1f} s after SIGCONT",
         "hf meanwhile")  # fmt: skip


LIES = {
    "no JSON": lambda job: b"\xff\xfe nonsense",
    "an infinite fault": lambda job: json.dumps({"method": "hf", "k": [1e400] * 6}).encode(),
    "a linear estimate": lambda job: json.dumps({"method": "linear", "k": [0.1] * 6}).encode(),
    "the job itself": lambda job: job.rstrip(b"\n"),
    "nothing, connection closed": lambda job: None,
    "a line without end": lambda job: b"1" * (2 << 20),
}


def test_the_worker_lies(attack, tell, tmp_path):
    path = tmp_path / "liar.sock"
    lies = list(LIES.values())
    n_told = 0
    ended = threading.Event()

    def serve(server):
        while not ended.is_set():
            try:
                connection, _ = server.accept()
            except TimeoutError:
                continue
            threading.Thread(target=lie, args=(connection,), daemon=True).start()

    def lie(connection):
        nonlocal n_told
        with connection, connection.makefile("rb") as said, suppress(OSError):
            for line in said:
                answer = lies[n_told % len(lies)](line)
                n_told += b"i_hat" in line
                if answer is None:
                    break
                connection.sendall(answer + b"\n")

    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(path))
        server.listen(1)
        server.settimeout(0.2)
        liar = threading.Thread(target=serve, args=(server,), daemon=True)
        liar.start()
        daemon = attack(monitor={"slower": {"hf": {"every": "0.5 s"}}}, remote={"hf": str(path)})
        daemon.estimates(1)  # of a cycle that had begun before the daemon
        estimates = daemon.estimates(len(lies) + 2)
        ended.set()
        liar.join()
        status = daemon.stop()
    assert status == 0
    assert set(statuses(estimates)) == {Status.VALID}
    assert not [one for one in daemon.said if one.name == "EstimateHf"]
    n_events = sum(event["code"] == "job_failed" for event in daemon.events())
    assert n_told >= len(lies)
    assert n_events >= len(lies)
    outcome = f"{n_events} events, no such estimate sent, linear valid"
    tell("the HF worker answers " + ", ".join(LIES), n_told, outcome, "hf")
