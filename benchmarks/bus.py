"""What a frame costs on its way in: receive, check, decode, place; and the usual way on the same frames.

On vcan0 where this kernel has one, else on a pair of UDP sockets on loopback that carry the kernel's CAN FD frames as
datagrams of the same 72 bytes: the same system calls.
"""

from __future__ import annotations

import socket
import tempfile
import threading
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import can
import cantools
import numpy as np
from ema_simulator.fleet import Fleet
from ema_simulator.scenario import Scenario
from ema_simulator.traffic import Traffic

from ema.bus import mmsg
from ema.bus.codec import Codec
from ema.bus.keys import Keyring
from ema.bus.load import frame_time, load, sealed
from ema.bus.port import RECEIVE_BUFFER, ask_for_buffer
from ema.bus.protection import Receiver, Sender
from ema.bus.sealer import Sealer
from ema.bus.sessions import Sessions
from ema.bus.socketcan import SocketCanPort
from ema.bus.verifier import Verifier
from ema.core import can_messages, config, resources
from ema.core.errors import BusError
from ema.core.frames import FrameFlag, joined
from ema.models.actuator import Actuator
from ema.monitor.assembler import Assembler
from ema.monitor.settings import MonitorSettings

SEED = 11
N_ACTUATORS = 6
LIVE, FULL = 30, 500  # frames in a batch: six actuators read every 5 ms; a queue that has filled up
ROUNDS = 7
BUS_FULL = round(1.0 / frame_time(64, 1e6, 5e6))  # frames of 64 bytes that a bus of 1 and 5 Mbit/s carries [1/s]
REFUSED = int(FrameFlag.REFUSED)
PEER = "python-can Notifier + cantools decode"


class _Link:
    """Where frames are put in and taken out again, a batch at a time."""

    def __init__(self, stack: ExitStack):
        self._batch_in, self._batch_out = mmsg.Batch(), mmsg.Batch()
        try:
            self._ports = [stack.enter_context(SocketCanPort("vcan0")) for _ in range(2)]
            self.name = "vcan0"
        except BusError:
            self._ports = []
            self._in, self._out = (
                stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(2)
            )
            self._in.setsockopt(socket.SOL_SOCKET, mmsg.SO_TIMESTAMPNS, 1)
            ask_for_buffer(self._in, RECEIVE_BUFFER)
            self._in.bind(("127.0.0.1", 0))
            self._in.setblocking(False)
            self._out.connect(self._in.getsockname())
            self.name = "UDP loopback, no CAN in this kernel"

    def put(self, frames: np.ndarray) -> None:
        n_sent = 0
        while n_sent < frames.size:
            part = frames[n_sent:]
            n_sent += self._ports[1].write(part) if self._ports else self._batch_out.send(self._out.fileno(), part)

    def take(self) -> np.ndarray:
        if self._ports:
            return self._ports[0].read(0.0)
        return mmsg.from_kernel(self._batch_in.receive(self._in.fileno()))


def rows() -> list[dict[str, Any]]:
    """Medians over rounds of one test cycle of six actuators; CPU time, so that other work does not count."""
    plant = config.load(resources.config("actuator.yaml"), Actuator)
    codec = Codec()
    before, frames = _two_cycles(plant, codec)
    found = []

    def row(
        figure: str,
        value: float,
        limit: float | None = None,
        peer: str = "",
        peer_value: float | None = None,
        unit: str = "µs of CPU/frame",
    ):
        found.append(
            {
                "figure": figure,
                "value": round(value, 2),
                "unit": unit,
                "limit": limit,
                "peer": peer,
                "peer_value": None if peer_value is None else round(peer_value, 2),
                "seed": SEED,
            }
        )

    with ExitStack() as stack:
        link = _Link(stack)
        peer_value = _median(lambda: _peer(frames, link.name == "vcan0"))
        for size in (LIVE, FULL):
            parts = _median_each(lambda size=size: _way_in(before, frames, size, link, codec, plant))
            what = f"batches of {size}, {link.name}"
            row(f"frame in: receive, check, decode, place ({what})", parts[0] + parts[1], 5.0, PEER, peer_value)
            row(
                f"  frames one core takes; a full bus of 1 and 5 Mbit/s has {BUS_FULL} ({what})",
                1e6 / sum(parts),
                unit="1/s",
            )
            row(f"  of which receive ({what})", parts[0])
            row(
                f"  of which check alone (batches of {size})",
                _median(lambda size=size: _check(before, frames, size, codec)),
            )
    own = [message for message in codec.messages.values() if message.sender == "Actuator"]
    one = load(own, 1e6, 5e6), load(own, 1e6, 5e6, worst=True)
    for what, n in (("six in turns, two at once", 2), ("six at once", 6)):
        limit = 50.0 if n == 2 else 100.0
        row(f"bus of 1 and 5 Mbit/s, {what}: its load ({100 * n * one[1]:.0f} % with all stuff bits)",
            100 * n * one[0], limit, unit="%")  # fmt: skip
    row("frame out: sequence and CRC", _median(lambda: _protect(frames)))
    sealed_own = sealed(own, codec)
    one = load(sealed_own, 1e6, 5e6), load(sealed_own, 1e6, 5e6, worst=True)
    for what, n in (("one actuator", 1), ("six in turns, two at once", 2), ("six at once", 6)):
        name = f"bus of 1 and 5 Mbit/s, {what}, authenticated: its load ({100 * n * one[1]:.0f} % with all stuff bits)"
        row(name, 100 * n * one[0], unit="%")
    with ExitStack() as stack:
        link = _Link(stack)
        costs = _median_each(lambda: _authenticated(frames, codec, link))
    row("authentication: frame out, sealed", costs[0])
    row(f"authentication: genuine frame in, its seals included ({link.name})", costs[1])
    row(f"authentication: forged frame in, half of them seals: receive, verify, check ({link.name})", costs[3], 30.0)
    row("authentication: MACs computed for each received frame", costs[2], 1.0, unit="")
    row("authentication: MACs computed for each forged frame", costs[4], 1.0, unit="")
    return found


def _two_cycles(plant: Actuator, codec: Codec) -> list[np.ndarray]:
    numbers = list(range(N_ACTUATORS))
    scenario = Scenario.model_validate({"seed": SEED, "actuators": [{"number": n} for n in numbers]})
    fleet, traffic = Fleet(scenario, plant), Traffic(codec, numbers)
    cycles = []
    for number in range(2):
        frames, due = traffic.frames(fleet.next_cycle(np.zeros((N_ACTUATORS, 6))), scenario.period)
        frames["t_ns"] = ((number * scenario.period + due) * 1e9).astype(np.uint64)
        cycles.append(frames)
    return cycles


def _batches(frames: np.ndarray, size: int) -> list[np.ndarray]:
    return [frames[n : n + size] for n in range(0, frames.size, size)]


def _way_in(
    before: np.ndarray, frames: np.ndarray, size: int, link: _Link, codec: Codec, plant: Actuator
) -> tuple[float, float]:
    """Time to receive and time for the rest, once the streams are running."""
    assembler = Assembler(codec, dict.fromkeys(range(N_ACTUATORS), plant), MonitorSettings())
    list(assembler.feed(before))
    receiving = placing = 0.0
    n_cycles = n_frames = 0
    for batch in _batches(frames, size):
        link.put(batch)
        begin = time.process_time()
        received = link.take()
        middle = time.process_time()
        n_cycles += len(list(assembler.feed(received)))
        placing += time.process_time() - middle
        receiving += middle - begin
        n_frames += received.size
    if n_frames != frames.size or n_cycles != N_ACTUATORS:
        raise RuntimeError(f"{n_frames} of {frames.size} frames, {n_cycles} of {N_ACTUATORS} cycles arrived")
    return receiving / n_frames * 1e6, placing / n_frames * 1e6


def _check(before: np.ndarray, frames: np.ndarray, size: int, codec: Codec) -> float:
    receiver, batches = Receiver(codec), _batches(frames, size)
    receiver.check(before)
    begin = time.process_time()
    for batch in batches:
        receiver.check(batch)
    return (time.process_time() - begin) / frames.size * 1e6


def _sealed(frames: np.ndarray, codec: Codec, folder: Path) -> tuple[float, list[np.ndarray], Verifier]:
    """Time to seal a frame, each frame with the seals it leads to, and a receiver that knows the senders."""
    ring = Keyring({None: [bytes(16)]})
    sealer, verifier = Sealer(codec, ring, Sessions(folder / "session")), Verifier(codec, ring)
    verifier.feed(sealer.add(frames), 0)
    verifier.feed(sealer.hear(verifier.ask(0), 0), 0)
    begin = time.process_time()
    seals = [sealer.add(frames[n : n + 1]) for n in range(frames.size)]
    took = time.process_time() - begin
    for n, made in enumerate(seals):
        made["t_ns"] = frames["t_ns"][n]
    return took / frames.size * 1e6, [joined([frames[n : n + 1], made]) for n, made in enumerate(seals)], verifier


def _authenticated(frames: np.ndarray, codec: Codec, link: _Link) -> list[float]:
    """What authentication costs: sealing, verifying a genuine frame, its share of trials, and a forged one all in.

    Forged frames have the number of a genuine one, so that each is tried when that one's seal comes; forged seals claim
    a session to come. Half are of either kind.
    """
    n_forged = 4
    with tempfile.TemporaryDirectory(prefix="ema-bench-") as folder:
        sealing, genuine, verifier = _sealed(frames, codec, Path(folder))
    alone, _, n_trials = _verified(joined(genuine), frames.size, codec, link, verifier)
    with tempfile.TemporaryDirectory(prefix="ema-bench-") as folder:
        _, genuine, verifier = _sealed(frames, codec, Path(folder))
    seals = [part[1:] for part in genuine if part.size > 1]
    on_bus = []
    for n, part in enumerate(genuine):
        other = np.repeat(part[:1], n_forged // 2)
        other["data"][:, 5] ^= 1 + np.arange(other.size, dtype=np.uint8)
        claim = np.repeat(seals[n % len(seals)][:1], n_forged // 2)
        claim["data"][:, 8] = 0x80 + np.arange(claim.size)
        claim["t_ns"] = part["t_ns"][0]
        on_bus += [other, claim, part]
    every = joined(on_bus)
    together, _, n_with = _verified(every, frames.size, codec, link, verifier)
    n_more = n_forged * frames.size
    return [
        sealing,
        alone / frames.size,
        n_with / every.size,
        (together - alone) / n_more,
        (n_with - n_trials) / n_more,
    ]


def _verified(
    frames: np.ndarray, n_genuine: int, codec: Codec, link: _Link, verifier: Verifier
) -> tuple[float, int, int]:
    """Time to receive, verify and check frames [µs], how many were genuine, and MACs computed."""
    receiver, n_passed, taken, before = Receiver(codec), 0, 0.0, verifier.n_trials
    for batch in _batches(frames, LIVE):
        link.put(batch)
        begin = time.process_time()
        received = link.take()
        taken += time.process_time() - begin
        received["t_ns"] = batch["t_ns"]
        begin = time.process_time()
        decided = verifier.feed(received, 0)
        receiver.check(decided)
        taken += time.process_time() - begin
        n_passed += int(((decided["flags"] & REFUSED) == 0).sum())
    if n_passed != n_genuine:
        raise RuntimeError(f"{n_passed} of {n_genuine} frames are found genuine")
    return taken * 1e6, n_passed, verifier.n_trials - before


def _protect(frames: np.ndarray) -> float:
    sender, copy = Sender(), frames.copy()
    begin = time.process_time()
    sender.protect(copy)
    return (time.process_time() - begin) / frames.size * 1e6


class _Decoder(can.Listener):
    """What one writes with python-can and cantools: look the message up, decode it."""

    def __init__(self, n_frames: int):
        self._database: Any = cantools.database.load_file(resources.dbc(), frame_id_mask=0x9FFFFF03)
        self._left = n_frames
        self.done = threading.Event()

    def on_message_received(self, msg: can.Message) -> None:
        # `decode_message` of cantools 45.1 does not apply the mask for the actuator number; this is the rest of it.
        self._database.get_message_by_frame_id(msg.arbitration_id).decode(msg.data)
        self._left -= 1
        if not self._left:
            self.done.set()


def _peer(frames: np.ndarray, has_vcan: bool) -> float:
    """The queue is full when the Notifier starts, so that it never waits."""
    frames = frames[: FULL // 2]  # what the kernel's default receive buffer holds
    where: dict[str, Any] = {"interface": "virtual", "channel": "bench", "protocol": can.CanProtocol.CAN_FD}
    if has_vcan:
        where = {"interface": "socketcan", "channel": "vcan0", "fd": True}
    listener = _Decoder(frames.size)
    with can.Bus(**where) as bus_in, can.Bus(**where) as bus_out:
        for frame in frames:
            bus_out.send(can_messages.message(frame))
        begin = time.process_time()
        notifier = can.Notifier(bus_in, [listener])
        if not listener.done.wait(10):
            raise RuntimeError("python-can lost frames")
        took = time.process_time() - begin
        notifier.stop()
    return took / frames.size * 1e6


def _median(measure: Any) -> float:
    return float(np.median([measure() for _ in range(ROUNDS)]))


def _median_each(measure: Any) -> list[float]:
    return np.median([measure() for _ in range(ROUNDS)], axis=0).tolist()


if __name__ == "__main__":
    for found in rows():
        print(found)
