"""The daemon as a process of its own: on a bus, under a service manager, ended by a signal."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from ema_daemon.notify import notify

from ema.bus.interface import BusSettings, open_bus
from ema.log import LogReader

EMA = Path(sys.executable).with_name("ema")


@pytest.fixture
def manager(tmp_path):
    """The socket a service manager listens on."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
        sock.bind(str(tmp_path / "notify"))
        sock.settimeout(60)
        yield sock


@pytest.fixture
def bus():
    """A multicast group of this process' own."""
    return {"interface": "udp_multicast", "channel": f"239.74.{os.getpid() % 200}.{os.getpid() // 200 % 200}"}


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_service_from_ready_to_stopped(write_config, manager, bus, frames, tmp_path, number):
    config = write_config(bus=bus)
    environment = {**os.environ, "NOTIFY_SOCKET": manager.getsockname()}
    process = subprocess.Popen([EMA, "daemon", "--config", config], env=environment, stderr=subprocess.PIPE, text=True)
    try:
        assert manager.recv(100) == b"READY=1"
        with open_bus(BusSettings(**bus)) as port:
            cycle = frames[frames["t_ns"] < frames["t_ns"][0] + 600_000_000]
            for part in np.array_split(cycle, 20):
                port.write(part)
                time.sleep(0.02)
        assert manager.recv(100) == b"WATCHDOG=1"
        process.send_signal(number)
        while (state := manager.recv(100)) == b"WATCHDOG=1":
            pass
        assert state == b"STOPPING=1"
        _, said = process.communicate(timeout=60)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == 0
    assert "Traceback" not in said
    with LogReader(tmp_path / "log") as log:
        assert not log.unfinished
        estimates = [m.content for m in log.messages(lambda topic: topic == "/estimate/0/linear")]
        assert [e["cycle"] for e in estimates] == [0]
        assert estimates[0]["status"] == "valid"
        assert set(log.attachments()) == {
            *("ema.dbc", "daemon.yaml", "alarms.yaml", "manifest.json", "identification.json")
        }


def test_a_service_manager_that_does_not_listen_is_not_waited_for(tmp_path, monkeypatch):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
        sock.bind(str(tmp_path / "deaf"))
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "deaf"))
        for _ in range(1000):
            notify("WATCHDOG=1")
    notify("WATCHDOG=1")  # gone altogether
    monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "nothing"))
    notify("WATCHDOG=1")
