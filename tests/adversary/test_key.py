"""With a key: forged frames beside genuine ones, and a sender without it."""

from __future__ import annotations

import secrets
import threading
import time

import numpy as np
import pytest
from attacked import K, of, reasons, sealed, statuses

from ema.bus import codec as codecs
from ema.bus.interface import BusSettings, open_bus
from ema.core import frames as fr
from ema.core.status import Lapse, Reason, ServiceState, Status

CODEC = codecs.default()
_NEAR = 0.03  # of k: one noisy cycle by a coarse bundle


@pytest.fixture
def key(tmp_path):
    path = tmp_path / "bus.key"
    path.write_text(secrets.token_hex(16) + "\n")
    path.chmod(0o600)
    return path


@pytest.fixture
def locked(attack, key):
    """A daemon with a key, whose actuator has it too and answers when it is asked for its session."""
    daemon = attack(before=lambda bus: bus | {"key_file": str(key)})
    port = open_bus(BusSettings(**daemon.bus, key_file=key), [], role="Actuator")
    daemon.actuator.port = port
    ended = threading.Event()

    def listen():
        while not ended.is_set():
            port.read(0.05)

    listener = threading.Thread(target=listen, daemon=True)
    listener.start()
    yield daemon
    daemon.actuator.stop()
    ended.set()
    listener.join()
    port.close()


def halved(frames):
    """The same frames of currents with half the current and a right CRC."""
    own = frames[of(frames, "PhaseCurrents")]
    for name in ("i_a", "i_b"):
        field = CODEC.messages["PhaseCurrents"].fields[name].view(own)
        field[...] = field // 2
    return sealed(own)


def test_forged_currents_beside_the_genuine(locked, tell):
    """Right identifier, number and CRC, before each genuine frame; only the seal is missing."""
    daemon, n_forged = locked, 0
    while statuses(daemon.estimates(1)) != [Status.VALID]:
        pass

    def forged_first(frames):
        nonlocal n_forged
        forged = halved(frames)
        n_forged += daemon.port.write(forged)
        return frames

    daemon.actuator.change = forged_first
    estimates = daemon.estimates(4)[1:]
    assert all(reasons(one) & Reason.AUTHENTICATION for one in estimates)
    assert all(np.abs(np.asarray(one.values["k"]) - K).max() < _NEAR for one in estimates)
    named = ", ".join(sorted({status.name.lower() for status in statuses(estimates)}))
    tell("forged currents before each genuine frame, with a key", n_forged,
         f"refused; {named}, `authentication`, each estimate within {_NEAR} of the truth", "nothing")  # fmt: skip


def test_a_flood_of_forged_frames(locked, tell):
    daemon, n_forged = locked, 0
    while statuses(daemon.estimates(1)) != [Status.VALID]:
        pass

    def flood(frames):
        nonlocal n_forged
        forged = halved(frames)
        if forged.size:
            n_forged += daemon.port.write(fr.joined([forged] * 5))
        return frames

    daemon.actuator.change = flood
    estimates = daemon.estimates(4)[1:]
    assert Status.VALID not in statuses(estimates)
    assert all(np.abs(np.asarray(one.values["k"]) - K).max() < _NEAR for one in estimates)
    tell(
        "five forged frames beside each genuine one, with a key",
        n_forged,
        "refused, counted, the truth estimated",
        "nothing",
    )


def test_an_actuator_without_the_key(attack, tell, key):
    daemon = attack(before=lambda bus: bus | {"key_file": str(key)})
    beat = daemon.until(lambda one: one.name == "Heartbeat" and one.values["n_refused"] > 500)[0]
    assert not [
        one for one in daemon.said if one.name.startswith("Estimate") and one.values["status"] <= Status.DEGRADED
    ]
    tell("an actuator that has no key", beat.values["n_refused"], "every frame refused, no usable estimate", "nothing")


LOSSES = {"MonitorChallenge": "the monitor's challenges", "ActuatorSession": "the answers to its challenges"}


@pytest.mark.parametrize("name", LOSSES)
def test_a_session_is_not_agreed_upon_at_once(locked, tell, monkeypatch, name):
    """Of the handshake that a monitor that has just started needs, the first messages are lost."""
    daemon, inner, gets_through, lost = locked, locked.actuator.port._port, threading.Event(), []
    read, write = inner.read, inner.write

    def without(frames):
        theirs = of(frames, name)
        if gets_through.is_set() or not theirs.any():
            return frames
        lost.extend(frames[theirs])
        return frames[~theirs]

    daemon.process.kill()
    daemon.process.wait()
    monkeypatch.setattr(inner, "read", lambda timeout: without(read(timeout)))
    monkeypatch.setattr(inner, "write", lambda frames: write(without(frames)))
    n_before = len(daemon.said)
    daemon.start()
    daemon.until_state(ServiceState.DEGRADED, Lapse.SILENT)
    while len(lost) < 3:
        time.sleep(0.1)
    assert not [one for one in daemon.said[n_before:] if one.name.startswith("Estimate")]
    gets_through.set()
    again = daemon.until(lambda one: one.name == "EstimateLinear" and one.values["status"] == Status.VALID)[1]
    daemon.until_state(ServiceState.RUNNING)
    tell(f"{LOSSES[name]} are lost after its start", len(lost),
         f"asked again every second; meanwhile degraded, `silent`; valid {again:.1f} s after one gets through",
         "the cycles meanwhile")  # fmt: skip
