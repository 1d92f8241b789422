"""What a frame costs on its way in: receive, check, decode, place; and the usual way on the same frames.

On vcan0 where this kernel has one, else on a pair of UDP sockets on loopback that carry the kernel's CAN FD frames as
datagrams of the same 72 bytes: the same system calls.
"""

from __future__ import annotations

import socket
import threading
import time
from contextlib import ExitStack
from typing import Any

import can
import cantools
import numpy as np
from ema_simulator.fleet import Fleet
from ema_simulator.scenario import Scenario
from ema_simulator.traffic import Traffic

from ema.bus import mmsg
from ema.bus.authentication import Sealer, Verifier
from ema.bus.codec import Codec
from ema.bus.load import frame_time, load
from ema.bus.port import RECEIVE_BUFFER, ask_for_buffer
from ema.bus.protection import Receiver, Sender
from ema.bus.socketcan import SocketCanPort
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
    for what, n_forged in (("", 0), (", two forged ones beside each", 2)):
        row(f"frame verified, message authentication{what}", _median(lambda n=n_forged: _verify(frames, n, codec)))
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


def _verify(frames: np.ndarray, n_forged: int, codec: Codec) -> float:
    """Time for each genuine frame, seals included; forged ones have its number, so that each costs a MAC as well."""
    key, on_bus = bytes(16), []
    sealer, verifier = Sealer(codec, key), Verifier(codec, key)
    for n in range(frames.size):
        forged = np.repeat(frames[n : n + 1], n_forged)
        forged["data"][:, 5] ^= 1
        t_ns = int(frames["t_ns"][n])
        seals = sealer.add(frames[n : n + 1], t_ns)
        seals["t_ns"] = t_ns
        on_bus += [forged, frames[n : n + 1], seals]
    batches = _batches(joined(on_bus), LIVE)
    begin = time.process_time()
    n_passed = sum(int(((verifier.feed(part, 0)["flags"] & REFUSED) == 0).sum()) for part in batches)
    took = time.process_time() - begin
    if n_passed != frames.size:
        raise RuntimeError(f"{n_passed} of {frames.size} frames are found genuine")
    return took / frames.size * 1e6


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
