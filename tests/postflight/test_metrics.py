"""`ema metrics`: what Prometheus reads is what was on the bus, and the dashboard asks for nothing else."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import numpy as np
import pytest
from ema_postflight.exposition import Exposition
from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.parser import text_string_to_metric_families

from ema.bus import codec as codecs
from ema.bus.interface import open_bus, parse
from ema.bus.protection import Sender
from ema.core import resources

T0 = 1_741_943_700_000_000_000
CODEC = codecs.default()
DASHBOARD = json.loads(resources.config("grafana-dashboard.json").read_text())
_WORD = re.compile(r"\b(ema_\w+)(?:\{([^}]*)\})?")


def frames(t_ns=T0):
    """What a monitor sends: two estimates, an alarm of an actuator and one of its own, a heartbeat."""
    sender, parts = Sender(), []

    def send(name, actuator, **values):
        fields = CODEC.messages[name].fields
        zero = {key: np.zeros((1, f.n_values)) if f.n_values else 0 for key, f in fields.items()}
        parts.append(CODEC.encode(name, actuator, zero | values, t_ns))

    k, sd = np.array([[0.1, 0.02, 0, 0, 0, 0.9]]), np.full((1, 6), 0.05)
    send("EstimateLinear", 3, cycle=7, k=k, sd_k=sd, status=1, age=0.0015)
    send("EstimateLf2", 4, cycle=8, status=2, age=0.3)
    for cause, level, actuator in (("k1", 2, 3), ("log", 1, 0)):
        number = CODEC.number("Alarm", "cause", cause)
        send("Alarm", actuator, cause=number, level=level, state=1, n_standing=1, since=np.uint64(t_ns))
    send("Heartbeat", 0, state=2, log_state=1, log_free=512, uptime=60, n_cycles=100, n_lost=3)
    return sender.protect(np.concatenate(parts))


@pytest.fixture
def read():
    """Samples by name and labels, as Prometheus reads them, so many seconds after the frames."""

    def go(seconds=1.0, heard=True, pid=None):
        registry = CollectorRegistry()
        exposition = Exposition(CODEC, registry, lambda: T0 + round(seconds * 1e9), pid)
        if heard:
            exposition.update(frames())
        families = text_string_to_metric_families(generate_latest(registry).decode())
        return {(s.name, frozenset(s.labels.items())): s.value for family in families for s in family.samples}

    return go


def sample(samples, name, **labels):
    return samples[name, frozenset(labels.items())]


def test_every_sample_is_what_was_sent(read):
    s = read(pid=os.getpid())
    own = {"actuator": "3", "method": "linear"}
    assert sample(s, "ema_k", **own, fault="k1") == pytest.approx(0.1)
    assert sample(s, "ema_k_low", **own, fault="k1") == pytest.approx(0.1 - 1.96 * 0.05)
    assert sample(s, "ema_k_low", **own, fault="k2") == 0.0
    assert sample(s, "ema_k_high", **own, fault="k6") == pytest.approx(0.998)
    assert sample(s, "ema_estimate_status", **own, status="degraded") == 1
    assert sample(s, "ema_estimate_status", **own, status="valid") == 0
    assert sample(s, "ema_estimate_age_seconds", **own) == 1.0
    assert sample(s, "ema_estimate_latency_seconds_bucket", method="linear", le="0.002") == 1
    assert sample(s, "ema_estimate_latency_seconds_bucket", method="lf2", le="0.2") == 0
    assert sample(s, "ema_alarm", actuator="3", cause="k1", level="alarm", state="active") == 1
    assert sample(s, "ema_alarm", actuator="monitor", cause="log", level="watch", state="active") == 1
    assert sample(s, "ema_alarms", level="alarm") == 1
    assert sample(s, "ema_up") == 1
    assert sample(s, "ema_state", state="degraded") == 1
    assert sample(s, "ema_log_state", state="full") == 1
    assert sample(s, "ema_log_free_bytes") == 512 << 20
    assert sample(s, "ema_cycles_total") == 100
    assert sample(s, "ema_frames_lost_total") == 3
    assert sample(s, "ema_resident_memory_bytes") > 1e6


def test_an_invalid_estimate_has_no_k(read):
    assert not [1 for name, labels in read() if name == "ema_k" and ("method", "lf2") in labels]


def test_what_is_not_heard_is_said(read):
    assert sample(read(seconds=10.0), "ema_up") == 0
    assert not [1 for name, _ in read(seconds=10.0) if name == "ema_alarm"]
    silent = read(heard=False)
    assert sample(silent, "ema_up") == 0
    assert sample(silent, "ema_heartbeat_age_seconds") == np.inf


def expressions():
    panels = [target["expr"] for panel in DASHBOARD["panels"] for target in panel["targets"]]
    lists = [one["definition"] for one in DASHBOARD["templating"]["list"] if "definition" in one]
    return sorted({*panels, *lists})


@pytest.mark.parametrize("expr", expressions())
def test_every_query_of_the_dashboard_names_what_is_there(expr, read):
    there = {}
    for name, labels in read(pid=os.getpid()):
        there.setdefault(name, set()).update(dict(labels))
    asked = _WORD.findall(expr)
    assert asked
    for name, selector in asked:
        assert name in there
        assert set(re.findall(r"(\w+)=", selector)) <= there[name]


def test_every_legend_is_a_label_of_its_query(read):
    there = {}
    for name, labels in read(pid=os.getpid()):
        there.setdefault(name, set()).update(dict(labels))
    for panel in DASHBOARD["panels"]:
        for target in panel["targets"]:
            names = {name for name, _ in _WORD.findall(target["expr"])}
            labels = set.union(*(there[name] for name in names))
            assert set(re.findall(r"\{\{(\w+)\}\}", target["legendFormat"])) <= labels, panel["title"]


def test_it_answers_on_loopback_and_ends_when_told(tmp_path):
    bus = f"udp_multicast:239.76.{os.getpid() % 200}.{os.getpid() // 200 % 200}"
    command = [Path(sys.executable).with_name("ema"), "metrics", "--bus", bus, "--port", "0"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        address = re.search(r"http://127\.0\.0\.1:\d+/metrics", process.stderr.readline()).group()
        text, end = "", time.monotonic() + 30
        with open_bus(parse(bus)) as port:
            while "ema_k{" not in text and time.monotonic() < end:
                port.write(frames(time.time_ns()))
                time.sleep(0.2)
                text = urllib.request.urlopen(address, timeout=10).read().decode()
        assert 'ema_k{actuator="3",fault="k1",method="linear"}' in text
        process.send_signal(signal.SIGTERM)
        assert process.wait(30) == 0
    finally:
        process.kill()
        process.communicate()
