"""Everything in this folder needs a real SocketCAN interface `vcan0`: `make test-vcan` gives it one."""

import os
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import yaml

from ema.bus import codec
from ema.bus.port import RECEIVE_BUFFER
from ema.bus.socketcan import SocketCanPort
from ema.core.status import Reason, Status
from ema.log import LogReader

HERE = Path(__file__).parent
INTERFACE = "vcan0"


def pytest_collection_modifyitems(items):
    for item in items:
        if HERE in item.path.parents:
            item.add_marker(pytest.mark.vcan)


def pytest_terminal_summary(terminalreporter):
    def count(outcome):
        reports = terminalreporter.stats.get(outcome, [])
        return sum("vcan" in getattr(report, "keywords", ()) for report in reports)

    counts = ", ".join(f"{count(outcome)} {outcome}" for outcome in ("passed", "failed", "error", "skipped"))
    terminalreporter.write_line(f"on a real vcan0: {counts}; kernel {os.uname().release}")


@pytest.fixture(autouse=True, scope="session")
def vcan0(request):
    """The interface's name. Without the interface: skipped, but a failure where these tests were asked for by name."""
    if INTERFACE not in dict(socket.if_nameindex()).values():
        stop = pytest.fail if request.config.getoption("markexpr") == "vcan" else pytest.skip
        stop(f"no {INTERFACE} here: use `make test-vcan`")
    return INTERFACE


@pytest.fixture
def link(vcan0):
    """A Link to vcan0; afterwards the interface is there and up again, whatever the test has done."""
    link = Link(vcan0)
    yield link
    if INTERFACE not in dict(socket.if_nameindex()).values():
        link.create()
    subprocess.run(["tc", "qdisc", "delete", "dev", vcan0, "root"], check=False, stderr=subprocess.DEVNULL)
    link.up()


class Link:
    """The interface as root handles it."""

    def __init__(self, interface):
        self._interface = interface

    def down(self):
        _run("ip", "link", "set", self._interface, "down")

    def up(self):
        _run("ip", "link", "set", self._interface, "up")

    def set_mtu(self, mtu):
        self.down()
        _run("ip", "link", "set", self._interface, "mtu", str(mtu), "up")

    def delete(self):
        _run("ip", "link", "delete", self._interface)

    def create(self):
        _run("ip", "link", "add", "dev", self._interface, "type", "vcan")
        self.set_mtu(72)

    def throttle(self):
        """A transmit queue of a few frames that hardly drains: a full one answers ENOBUFS."""
        _run(*f"tc qdisc add dev {self._interface} root tbf rate 64bit burst 200 limit 400".split())

    def release(self):
        _run("tc", "qdisc", "delete", "dev", self._interface, "root")


def _run(*words):
    subprocess.run(words, check=True)


class RawCan(socket.socket):
    """A raw CAN FD socket on an interface, written without any code of the project: the tests' own witness."""

    FRAME = struct.Struct("<IBBxx64s")
    EXTENDED = socket.CAN_EFF_FLAG

    def __init__(self, interface):
        super().__init__(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
        self.bind((interface,))
        self.settimeout(10)

    def send_frame(self, can_id, data):
        """Send `data` as a CAN FD frame; `can_id` with the kernel's flag bits (EXTENDED)."""
        self.send(self.FRAME.pack(can_id, len(data), 0, data))

    def send_classic(self, can_id, data):
        """Send `data` as a classic CAN frame."""
        self.send(struct.pack("<IB3x8s", can_id, len(data), data))

    def send_error(self, error_class):
        """What a controller's driver hands up; vcan has no errors of its own."""
        self.send_classic(error_class | socket.CAN_ERR_FLAG, bytes(8))

    def receive_frame(self):
        """The next CAN FD frame: (can_id, data)."""
        can_id, length, _flags, data = self.FRAME.unpack(self.recv(self.FRAME.size))
        return can_id, data[:length]


@pytest.fixture
def raw_can(vcan0):
    """Opens RawCan sockets on vcan0: `raw_can()`."""
    opened = []

    def open_one():
        opened.append(RawCan(vcan0))
        return opened[-1]

    yield open_one
    for can in opened:
        can.close()


@pytest.fixture
def candump(vcan0, tmp_path):
    """Starts can-utils' candump, waits until it listens: `dump = candump(3)`; `dump()` gives its next 3 log lines."""
    running = []

    def start(n_frames):
        words = ["candump", "-L", "-n", str(n_frames), "-T", "120000", "-r", str(RECEIVE_BUFFER), vcan0]
        listeners, lines = _n_listeners(), tmp_path / f"candump-{len(running)}.log"
        with lines.open("w") as file:  # a pipe nobody reads meanwhile would stop it
            process = subprocess.Popen(words, stdout=file)
        running.append(process)
        deadline = time.monotonic() + 30
        while _n_listeners() == listeners:
            assert process.poll() is None, "candump ended at once"
            assert time.monotonic() < deadline, "candump did not open its socket"
            time.sleep(0.02)

        def end():
            process.wait(timeout=180)
            return lines.read_text().splitlines()

        return end

    yield start
    for process in running:
        process.kill()
        process.wait()


def _n_listeners():
    """Raw sockets that receive every frame, as the kernel lists them."""
    return Path("/proc/net/can/rcvlist_all").read_text().count(" raw")


@pytest.fixture(scope="module")
def daemon_on_vcan0(vcan0, coarse_bundle):
    """Starts `ema daemon` processes on vcan0: `daemon_on_vcan0(folder)`; they end with the test file at the latest."""
    started = []

    def start(folder, numbers=(0,), **log_settings):
        started.append(DaemonProcess(vcan0, dict.fromkeys(numbers, coarse_bundle.path), folder, log_settings))
        return started[-1]

    yield start
    for daemon in started:
        daemon.close()


class DaemonProcess:
    """An `ema daemon` of its own process, and what it broadcasts."""

    def __init__(self, interface, bundles, folder, log_settings):
        self.log_folder = folder / "log"
        self.log_folder.mkdir(exist_ok=True)
        settings = {
            "bus": {"interface": "socketcan", "channel": interface},
            "actuators": {number: {"bundle": str(bundle)} for number, bundle in bundles.items()},
            "log": {"directory": str(self.log_folder), "flush_interval": 0.2, **log_settings},
        }
        (folder / "daemon.yaml").write_text(yaml.safe_dump(settings))
        self._codec = codec.default()
        self._port = SocketCanPort(interface, self._codec.filters("Monitor"))
        self._waiting = []
        words = [Path(sys.executable).with_name("ema"), "daemon", "--config", folder / "daemon.yaml"]
        self._said = folder / "stderr"
        with self._said.open("w") as said:
            self.process = subprocess.Popen(words, stderr=said)
        self.next("Heartbeat")

    def next(self, name, wanted=lambda values: True, patience=60):
        """Values of the next message of this name that is wanted; those before it, of any name, are passed over."""
        end = time.monotonic() + patience
        while time.monotonic() < end and self.process.poll() is None:
            for values in self._messages(name):
                if wanted(values):
                    return values
        pytest.fail(f"no {name} that was wanted in {patience} s; the daemon: {self._said.read_text()}")

    def estimate(self, cycle):
        """(k as counts on the bus, status) of the linear estimate of a cycle."""
        k, status, _ = self.estimate_with_reasons(cycle)
        return k, status

    def estimate_with_reasons(self, cycle):
        """The same, and its reasons."""
        values = self.next("EstimateLinear", lambda values: values["cycle"] == cycle)
        scale = self._codec.messages["EstimateLinear"].fields["k"].scale
        k = np.round(values["k"] / scale).astype(int).tolist()
        return k, Status(int(values["status"])), Reason(int(values["reason"]))

    def _messages(self, name):
        for message, frames in self._codec.split(self._port.read(0.2)):
            if message.name == name:
                values = message.decode(frames)
                for row in range(len(frames)):
                    yield {key: value[row] for key, value in values.items()}

    def events(self):
        """Texts of the events logged so far."""
        with LogReader(self.log_folder) as log:
            return [m.content["text"] for m in log.messages(lambda topic: topic == "/event")]

    def wait_for_event(self, part, patience=60):
        """Wait until an event is in the log whose text has this part."""
        end = time.monotonic() + patience
        while not any(part in text for text in self.events()):
            assert time.monotonic() < end, f"no event '{part}' among {self.events()}"
            time.sleep(0.3)

    def cpu_time(self):
        """Processor time it has taken. [s]"""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def stop(self):
        """Ask it to end; its exit status."""
        self.process.terminate()
        return self.process.wait(timeout=60)

    def close(self):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self._port.close()
