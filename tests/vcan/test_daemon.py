"""The daemon as a process on a real vcan0, and what the kernel and other nodes do to it.

One daemon runs through the whole file; each test sends it the next simulated cycle. What its estimate has to be is
known from the pure monitor, fed with the same frames in this process.
"""

import lzma
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from ema.bus.codec import default
from ema.bus.socketcan import SocketCanPort
from ema.core.status import Reason, Status
from ema.monitor import Identified, Monitor, MonitorSettings

CAR_LOG = Path(__file__).parents[1] / "data/can_motec/can_sample.log.xz"
N_CYCLES = 20
CHUNK = 30  # frames sent at once


@pytest.fixture(scope="module")
def daemon(daemon_on_vcan0, tmp_path_factory):
    return daemon_on_vcan0(tmp_path_factory.mktemp("daemon"))


@pytest.fixture(scope="module")
def flight(fly):
    """Frames of each cycle, by cycle number."""
    cycles = fly(n_cycles=N_CYCLES, actuators=[{"number": 0, "faults": {"k3": 0.06, "k1": 0.03}}])
    return {cycle.number: frames for cycle, frames in cycles}


@pytest.fixture(scope="module")
def expected(flight, coarse_bundle):
    """k of each cycle as counts on the bus."""
    codec = default()
    monitor = Monitor({0: coarse_bundle}, codec, MonitorSettings(slower={}))
    outputs = [out for frames in flight.values() for out in monitor.update(frames)] + monitor.finish()
    scale = codec.messages["EstimateLinear"].fields["k"].scale
    found = [out for out in outputs if isinstance(out, Identified)]
    return {out.cycle: np.round(out.estimate.k / scale).astype(int).tolist() for out in found}


@pytest.fixture(scope="module")
def numbers(flight):
    """The cycles not sent yet."""
    return iter(flight)


@pytest.fixture
def node(vcan0):
    with SocketCanPort(vcan0, filters=[]) as port:
        yield port


def send(node, frames, between=lambda: None):
    """Send frames at about the actuator's pace; call `between` after each chunk."""
    for start in range(0, len(frames), CHUNK):
        assert node.write(frames[start : start + CHUNK]) == len(frames[start : start + CHUNK])
        between()
        time.sleep(0.02)


def test_estimate_is_that_of_the_monitor(daemon, node, flight, expected, numbers):
    number = next(numbers)
    send(node, flight[number])
    k, status = daemon.estimate(number)
    assert k == expected[number]
    assert status is Status.VALID


def test_malformed_and_spoofed_frames_change_no_estimate(daemon, node, flight, expected, numbers):
    number, codec = next(numbers), default()
    before = daemon.next("Heartbeat")
    identifier = {name: f"{message.frame_id:08X}" for name, message in codec.messages.items()}
    junk = [
        f"{identifier['PhaseCurrents']}##1{'00' * 64}",  # no such CRC
        f"{identifier['PhaseCurrents']}##1{'FF' * 12}",  # too short
        f"{identifier['PhaseCurrents']}#0102030405060708",  # classic CAN
        f"{identifier['PhaseCurrents']}#R",  # remote request
        f"{identifier['CycleEnd']}##1{'00' * 24}",
        f"{identifier['CycleStart']}##1{'A5' * 24}",
        f"{identifier['EstimateLinear']}##1{'11' * 48}",  # as if from the monitor itself
        f"{identifier['SimulatorControl']}##1{'11' * 20}",  # the daemon takes no commands
        "123#DEADBEEF",
        "1FFFFFFF##1" + "00" * 64,
    ]
    again = flight[number][:40]  # true frames, once more: stale repetitions
    # In a process of its own: a pause in the actuator's frames would be a fault of another kind.
    cansend = subprocess.Popen(["sh", "-ec", "".join(f"cansend vcan0 {word}\n" for word in junk)])
    send(node, flight[number], lambda: node.write(again) if cansend.poll() is None else None)
    assert cansend.wait(timeout=60) == 0
    k, status, reasons = daemon.estimate_with_reasons(number)
    assert k == expected[number]
    # The same 40 frames again and again look like a second sender if they come often enough; what it says is true.
    assert status <= Status.DEGRADED or reasons & Reason.TWO_SPEAKERS
    after = daemon.next("Heartbeat", lambda beat: beat["n_cycles"] > before["n_cycles"])
    assert after["n_crc_error"] > before["n_crc_error"]
    assert after["n_wrong_length"] > before["n_wrong_length"]
    assert after["n_repeated"] > before["n_repeated"]


def test_link_down_and_up_between_cycles(daemon, node, link, flight, expected, numbers):
    number = next(numbers)
    link.down()
    daemon.wait_for_event("link down")
    link.up()
    node.read(0)
    send(node, flight[number])
    assert daemon.estimate(number)[0] == expected[number]
    daemon.wait_for_event("link up again")


def test_link_down_in_a_cycle_loses_only_what_was_not_sent(daemon, node, link, flight, numbers):
    """What arrived before counts: a cycle with a gap gets an estimate that says so, and the next one is clean."""
    number = next(numbers)
    frames, n = flight[number], len(flight[number])
    send(node, frames[: n // 2])
    link.down()
    time.sleep(0.05)
    link.up()
    send(node, frames[n // 2 + 40 :])
    values = daemon.next("EstimateLinear", lambda values: values["cycle"] == number)
    assert Status(int(values["status"])) >= Status.DEGRADED
    assert Reason(int(values["reason"])) & Reason.LOST_FRAMES


def test_interface_deleted_and_made_again(daemon, link, vcan0, flight, expected, numbers):
    number, pid = next(numbers), daemon.process.pid
    link.delete()
    daemon.wait_for_event("interface deleted")
    link.create()
    daemon.wait_for_event("interface is there again")
    daemon.next("Heartbeat")
    with SocketCanPort(vcan0, filters=[]) as node:
        send(node, flight[number])
        assert daemon.estimate(number)[0] == expected[number]
    assert daemon.process.poll() is None
    assert daemon.process.pid == pid


def test_full_transmit_queue(daemon, node, link, flight, expected, numbers):
    number = next(numbers)
    link.throttle()
    filler = flight[number][:1].copy()
    filler["id"] = 0x1ABCDEF0
    end = time.monotonic() + 3
    while time.monotonic() < end:  # keeps the queue full over several heartbeats
        node.write(filler)
    link.release()
    daemon.wait_for_event("cannot send: No buffer space")
    daemon.next("Heartbeat")
    send(node, flight[number])
    assert daemon.estimate(number)[0] == expected[number]


def test_bus_off_and_error_frames(daemon, raw_can, node, flight, expected, numbers):
    number, can = next(numbers), raw_can()
    for error in (0x20, 0x80, 0x40, 0x100):  # linux/can/error.h: no acknowledgement, bus error, bus-off, restarted
        can.send_error(error)
        time.sleep(0.1)
    send(node, flight[number], lambda: can.send_error(0x80))
    assert daemon.estimate(number)[0] == expected[number]
    for part in ("no acknowledgement", "bus-off", "controller restarted"):
        daemon.wait_for_event(part)


def test_foreign_traffic_at_full_speed(daemon, node, flight, expected, numbers, tmp_path, capsys):
    """A real car's log beside the actuator: no estimate changes, and the kernel's filter keeps its cost away."""
    number = next(numbers)
    lines = lzma.decompress(CAR_LOG.read_bytes()).decode().splitlines()[:20_000]
    log = tmp_path / "car.log"
    log.write_text("\n".join(_on_vcan0(line) for line in lines) + "\n")
    idle = daemon.cpu_time()
    time.sleep(2)
    idle = daemon.cpu_time() - idle
    before, began = daemon.cpu_time(), time.monotonic()
    player = subprocess.Popen(["canplayer", "-t", "-I", log, "vcan0=can0"], stdout=subprocess.DEVNULL)
    send(node, flight[number])
    assert player.wait(timeout=120) == 0
    took, cpu = time.monotonic() - began, daemon.cpu_time() - before
    k, status = daemon.estimate(number)
    assert k == expected[number]
    assert status is Status.VALID
    with capsys.disabled():
        print(
            f"\n{len(lines)} foreign frames in {took:.1f} s: daemon {cpu:.2f} s CPU with a cycle, idle {idle / 2:.3f}"
        )


def _on_vcan0(line):
    time_text, _interface, frame = line.split()[:3]
    return f"{time_text} can0 {frame}"


def test_stops_with_a_finished_log(daemon, expected):
    assert daemon.stop() == 0
    assert daemon.events()[-1].startswith("stopped")
