"""Somebody else on the bus: noise, floods, true frames again, losses. Estimates are right or marked."""

from __future__ import annotations

import socket
import threading
import time

import numpy as np
from attacked import SEED, K, of, reasons, sealed, statuses

from ema.bus import codec as codecs
from ema.bus import identifiers
from ema.bus.multicast import PORT
from ema.core import frames as fr
from ema.core.frames import FrameFlag
from ema.core.status import Reason, ServiceState, Status

CODEC = codecs.default()
_NEAR = 0.03  # of k: one noisy cycle by a coarse bundle


def random_frames(rng, n):
    """Of all messages and actuators, classic and FD, of any length; few have a right CRC."""
    frames = fr.empty(n)
    ids = np.array([message.frame_id for message in CODEC.messages.values()])
    frames["id"] = rng.choice(ids, n) | (rng.integers(0, 64, n) << 2).astype(np.uint32)
    frames["id"][::5] = rng.integers(0, 1 << 29, frames["id"][::5].size)
    frames["flags"] = FrameFlag.EXTENDED | rng.choice([0, int(FrameFlag.FD), int(FrameFlag.REMOTE)], n)
    frames["length"] = rng.integers(0, 65, n)
    frames["data"] = rng.integers(0, 256, (n, 64))
    for row in np.flatnonzero(frames["length"] < 64):
        frames["data"][row, frames["length"][row] :] = 0
    return frames


def near(estimate):
    return np.abs(np.asarray(estimate.values["k"]) - K).max() < _NEAR


def test_random_frames(attack, tell, times):
    n = times(5_000, 200_000)
    daemon, rng = attack(), np.random.default_rng(SEED)
    daemon.until_state(ServiceState.RUNNING)
    n_sent = 0

    def beside(frames):
        nonlocal n_sent
        noise = random_frames(rng, 50)
        n_sent += noise.size
        return fr.joined([noise, frames])

    daemon.actuator.change = beside
    estimates = []
    while n_sent < n:
        estimates += daemon.estimates(1)
    assert all(near(one) for one in estimates if statuses([one]) == [Status.VALID])
    assert Status.VALID in statuses(estimates)
    assert daemon.stop() == 0
    n_valid = statuses(estimates).count(Status.VALID)
    tell("random frames of all messages beside the true ones", n_sent,
         f"{n_valid} of {len(estimates)} estimates valid, each within {_NEAR} of the truth", "nothing")  # fmt: skip


def test_a_damaged_copy_before_each_frame(attack, tell):
    """Right identifier and number, wrong data: the CRC tells."""
    daemon, n_sent = attack(), 0
    daemon.until_state(ServiceState.RUNNING)

    def doubled(frames):
        nonlocal n_sent
        bad = frames.copy()
        bad["data"][:, 5] ^= 0x40
        n_sent += bad.size
        return np.ravel(np.column_stack([bad, frames]))

    daemon.actuator.change = doubled
    estimates = daemon.estimates(3)[1:]
    assert all(reasons(one) & Reason.CORRUPT_FRAMES for one in estimates)
    assert set(statuses(estimates)) == {Status.VALID}
    assert all(map(near, estimates))
    tell("a copy with one bit flipped before every frame", n_sent, "valid, `corrupt_frames`, counted", "nothing")


def test_every_frame_twice_and_old_ones_again(attack, tell):
    daemon, past, n_sent = attack(), [], 0
    daemon.until_state(ServiceState.RUNNING)

    def again(frames):
        nonlocal n_sent
        past.append(frames.copy())
        out = fr.joined([frames, frames, past[max(0, len(past) - 40)]])
        n_sent += out.size - frames.size
        return out

    daemon.actuator.change = again
    estimates = daemon.estimates(3)[1:]
    assert all(map(near, estimates))
    assert all(reasons(one) & Reason.REPEATED_FRAMES for one in estimates)
    named = ", ".join(sorted({status.name.lower() for status in statuses(estimates)}))
    tell("each frame twice, and those of 0.4 s ago", n_sent, f"{named}, `repeated_frames`, counted", "nothing")


def test_frames_are_lost(attack, tell, times):
    daemon, rng, n_lost = attack(), np.random.default_rng(SEED), 0
    daemon.until_state(ServiceState.RUNNING)

    def some(frames):
        nonlocal n_lost
        kept = (rng.random(frames.size) >= 0.05) | ~of(frames, "PhaseCurrents")
        n_lost += int((~kept).sum())
        return frames[kept]

    daemon.actuator.change = some
    estimates = daemon.estimates(times(4, 60))[1:]
    assert all(reasons(one) & Reason.LOST_FRAMES for one in estimates)
    assert Status.VALID not in statuses(estimates)
    counts = {status.name.lower(): statuses(estimates).count(status) for status in set(statuses(estimates))}
    tell("one of twenty frames of currents does not arrive", n_lost,
         ", ".join(f"{n} {name}" for name, n in sorted(counts.items())) + "; `lost_frames`, counted",
         "those frames")  # fmt: skip


def test_sequence_numbers_wrap_and_begin_anew(attack, tell):
    """65 535 is followed by 0; then the actuator restarts and counts from 0 in the middle of everything."""
    daemon = attack()
    daemon.until_state(ServiceState.RUNNING)
    for name in ("PhaseCurrents", "Motion", "CycleStart", "CycleEnd", "Supply"):
        sender = daemon.actuator.traffic._sender
        frame_id = CODEC.messages[name].frame_id
        sender.skip(frame_id, 65_400 - sender.next_sequence(frame_id))
    wrapped = daemon.estimates(4)
    for name in ("PhaseCurrents", "Motion", "CycleStart", "CycleEnd", "Supply"):
        sender = daemon.actuator.traffic._sender
        frame_id = CODEC.messages[name].frame_id
        sender.skip(frame_id, -sender.next_sequence(frame_id))
    restarted = daemon.estimates(4)
    assert statuses(wrapped)[-1] == statuses(restarted)[-1] == Status.VALID
    assert all(near(one) for one in wrapped + restarted if statuses([one]) == [Status.VALID])
    bad = [status for status in statuses(wrapped + restarted) if status != Status.VALID]
    tell("sequence numbers jump to 65 400, wrap, and begin at 0 again", 2, "followed; the last of four cycles is valid",
         f"{len(bad)} cycles not valid")  # fmt: skip


def test_a_flood_of_foreign_datagrams(attack, tell, times):
    """Not CAN at all, to the bus' own multicast group, as fast as one process can."""
    daemon = attack()
    daemon.until_state(ServiceState.RUNNING)
    ended, n_sent = threading.Event(), 0

    def flood():
        nonlocal n_sent
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
            sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
            sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
            sock.connect((daemon.bus["channel"], PORT))
            while not ended.is_set():
                for _ in range(100):
                    sock.send(b"\xc1not a frame")
                n_sent += 100

    began = time.monotonic()
    flooder = threading.Thread(target=flood, daemon=True)
    flooder.start()
    seconds = times(4.0, 30.0)
    beats = 0
    while time.monotonic() - began < seconds:
        daemon.until(lambda one: one.name == "Heartbeat")
        beats += 1
    ended.set()
    flooder.join()
    rate = n_sent / (time.monotonic() - began)
    again = daemon.until_state(ServiceState.RUNNING)
    assert beats >= seconds / 2
    assert statuses(daemon.estimates(1)) == [Status.VALID]
    outcome = f"{beats} heartbeats in {seconds:g} s; running {again:.1f} s after it"
    tell(f"{rate:.0f} datagrams a second that are no frames", n_sent, outcome, "frames the kernel dropped, counted")


def test_an_actuator_that_is_not_configured(attack, tell):
    daemon, n_sent = attack(), 0
    daemon.until_state(ServiceState.RUNNING)

    def as_another(frames):
        nonlocal n_sent
        other = frames.copy()
        other["id"] = [identifiers.with_actuator(i, 7) for i in other["id"].tolist()]
        n_sent += other.size
        return fr.joined([frames, sealed(other)])

    daemon.actuator.change = as_another
    estimates = daemon.estimates(3)
    assert {one.actuator for one in estimates} == {0}
    assert set(statuses(estimates)) == {Status.VALID}
    tell("cycles of an actuator that nobody configured", n_sent, "foreign, counted; the others valid", "nothing")
