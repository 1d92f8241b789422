"""`ema watch --foxglove`: a WebSocket client is told schemas and gets the numbers that are on the bus."""

from __future__ import annotations

import json
import re
import struct
import subprocess
import sys
import time
from contextlib import suppress

import numpy as np
import pytest
from ema_postflight.foxglove import MOST, FoxgloveServer
from websockets.sync.client import connect

from ema.bus import codec as codecs

T0 = 1_741_943_700_000_000_000
K = np.array([0.15, 0.0, 0.02, 0.0, 0.01, 0.3])


class Client:
    """A Foxglove client of the few words needed: subscribes to all that is advertised, collects what comes."""

    def __init__(self, socket):
        self._socket = socket
        self.schemas, self.values, self._topics = {}, {}, {}

    def listen(self, seconds):
        """Take what comes within so long."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            with suppress(TimeoutError):
                self._take(self._socket.recv(timeout=0.1))

    def _take(self, said):
        if isinstance(said, bytes):
            if said[0] == 1:
                number, t_ns = struct.unpack("<IQ", said[1:13])
                self.values.setdefault(self._topics[number], []).append((t_ns, json.loads(said[13:])))
            return
        told = json.loads(said)
        for one in told["channels"] if told["op"] == "advertise" else ():
            self.schemas[one["topic"]] = json.loads(one["schema"])
            self._topics[one["id"]] = one["topic"]
            wanted = [{"id": one["id"], "channelId": one["id"]}]
            self._socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))


def test_a_client_receives_schema_and_values(frame):
    wanted = {"/signals/estimate/3/linear", "/signals/currents/3", "/signals/status", "/signals/alarm/3/k1"}
    alarm = {"cause": 1, "level": 2, "state": 1, "value": 0.15, "low": 0.13, "high": 0.17, "limit": 0.1}
    with (
        FoxgloveServer(codecs.default(), "127.0.0.1", 0) as server,
        connect(server.url, subprotocols=["foxglove.sdk.v1"], open_timeout=20) as socket,
    ):
        client = Client(socket)
        for n in range(100):  # what comes before a channel is known and asked for is nobody's
            t_ns = T0 + n * 10**9
            server.update("vcan0", frame("EstimateLinear", 3, t_ns, k=K[None], sd_k=np.full((1, 6), 0.01)))
            server.update("vcan0", frame("PhaseCurrents", 3, t_ns, i_a=np.linspace(-5.0, 5.0, 10)[None]))
            server.update("vcan0", frame("Heartbeat", 0, t_ns, state=1, uptime=n))
            server.update("vcan0", frame("Alarm", 3, t_ns, **alarm))
            client.listen(0.2)
            if wanted <= set(client.values):
                break
    assert wanted <= set(client.schemas)
    assert wanted <= set(client.values)
    estimate = client.values["/signals/estimate/3/linear"][-1][1]
    assert [estimate[f"k{n}"] for n in range(1, 7)] == pytest.approx(K, abs=1e-4)
    assert estimate["low_k1"] == pytest.approx(0.15 - 1.96 * 0.01, abs=1e-3)
    assert client.schemas["/signals/currents/3"]["properties"]["i_a"]["unit"] == "A"
    assert client.values["/signals/alarm/3/k1"][-1][1]["level"] == 2
    assert client.values["/signals/status"][-1][1]["state"] == 1


def test_currents_are_thinned_and_keep_their_times(frame):
    with FoxgloveServer(codecs.default(), "127.0.0.1", 0) as server:
        seen = []
        server._send = seen.append
        frames = [frame("PhaseCurrents", 0, T0 + n * 1_000_000, i_a=np.arange(10.0)[None]) for n in range(100)]
        server.update("vcan0", np.concatenate(frames))
    t_ns = np.concatenate([series.t_ns for series in seen])
    assert len(t_ns) == pytest.approx(MOST * 0.1, abs=2)
    assert np.diff(t_ns).min() >= 1_000_000_000 // MOST


def test_a_port_that_is_taken_is_one_line(frame, tmp_path):
    with FoxgloveServer(codecs.default(), "127.0.0.1", 0) as server:
        port = server.url.rpartition(":")[2]
        words = ["watch", "--bus", "virtual:foxglove", "--foxglove", port, "--for", "1"]
        program = "from ema.cli import main; main()"
        done = subprocess.run([sys.executable, "-c", program, *words], capture_output=True, text=True, timeout=120)
    assert done.returncode == 2
    assert re.fullmatch(r"ema: Foxglove cannot be served on 127\.0\.0\.1:\d+ \(.*\)\n", done.stderr)


@pytest.mark.parametrize(("cause", "whose"), [("silent", "3"), ("log", "monitor")])
def test_an_alarm_is_shown_as_whose_it_is(frame, cause, whose):
    with FoxgloveServer(codecs.default(), "127.0.0.1", 0) as server:
        seen = []
        server._send = seen.append
        server.update(
            "vcan0", frame("Alarm", 3, cause=codecs.default().number("Alarm", "cause", cause), level=2, state=1)
        )
    assert [series.channel for series in seen] == [f"alarm/{whose}/{cause}"]
