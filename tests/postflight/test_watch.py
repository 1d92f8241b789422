"""The live view: what is on the bus is on the screen; nothing is sent; the terminal is left clean."""

import os
import pty
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from ema_postflight.live import Live
from ema_postflight.picture import draw
from ema_postflight.view import View
from rich.console import Console

from ema.bus import codec as codecs
from ema.bus.interface import open_bus, parse
from ema.core.status import Reason, Status

T0 = 1_741_943_700_000_000_000


def _estimate(frame, actuator, cycle, k, status=Status.VALID, reason=0, name="EstimateLinear"):
    values = {"cycle": cycle, "k": np.array([k]), "sd_k": np.full((1, 6), 0.01)}
    return frame(name, actuator, status=int(status), reason=int(reason), **values)


def _text(state, now_ns=T0, width=200, height=50, view=None):
    console = Console(width=width, record=True, file=open(os.devnull, "w"))  # noqa: SIM115
    console.print(draw(state, "bus vcan0", now_ns, width, height, view))
    console.file.close()
    return console.export_text()


def test_estimates_cycles_heartbeat_and_losses_are_shown(frame):
    state = Live(codecs.default())
    state.update(_estimate(frame, 3, 17, [0.15, 0, 0, 0.05, 0, 0]))
    state.update(frame("Heartbeat", state=1, uptime=5, n_cycles=18, n_lost=2))
    text = _text(state)
    for part in ("0.150 ±0.010", "0.050 ±0.010", "17", "valid", "daemon running, up 5 s", "lost 2", "cycles 18"):
        assert part in text, part
    assert "█" * 8 + "░" in text  # half a bar for k1


@pytest.mark.parametrize(("width", "height", "n"), [(200, 50, 2), (80, 24, 2), (80, 24, 16), (60, 20, 2)])
def test_a_window_of_any_size_shows_who_when_how_and_all_six(frame, width, height, n):
    state = Live(codecs.default())
    for number in range(n):
        state.update(_estimate(frame, number, 1700 + number, [0.123, 0.234, 0.345, 0.456, 0.567, 0.678]))
    state.update(frame("Heartbeat", state=1, uptime=5))
    lines = _text(state, width=width, height=height).splitlines()
    assert len(lines) <= height
    assert max(map(len, lines)) <= width
    text = "\n".join(lines)
    assert "…" not in text
    for number in range(n):
        assert str(1700 + number) in text
    for part in ("linear", "valid", "daemon running", "0.123", "0.234", "0.345", "0.456", "0.567", "0.678"):
        assert part in text, part


def _alarm(frame, cause, level=2, state=1, actuator=0, t_ns=T0, value=0.2):
    number = codecs.default().number("Alarm", "cause", cause)
    values = {"cause": number, "level": level, "state": state, "n_standing": 1, "value": value, "low": value - 0.01}
    return frame("Alarm", actuator, t_ns, since_cycle=7, since=np.uint64(T0), limit=0.1, **values)


@pytest.mark.parametrize(("width", "height"), [(80, 24), (100, 30), (149, 40), (200, 50)])
def test_labels_legend_keys_and_alarms_are_in_a_window_of_any_size(frame, width, height):
    state = Live(codecs.default())
    for number in range(6):
        state.update(_estimate(frame, number, 1700 + number, [0.123, 0.2, 0, 0, 0, 0]))
    state.update(frame("Heartbeat", state=2, uptime=5, reason=8, concerned=3))
    for cause in ("k1", "k2", "k3", "k1_rate"):
        state.update(_alarm(frame, cause, actuator=4))
    state.update(_alarm(frame, "log", level=1, state=2))
    lines = _text(state, width=width, height=height).splitlines()
    text = "\n".join(lines)
    assert len(lines) <= height
    assert max(map(len, lines)) <= width
    heading = next(line for line in lines if line.lstrip().startswith("act "))
    assert heading.split() == ["act", "by", "cycle", "age", "status", "k1", "k2", "k3", "k4", "k5", "k6"]
    with_mark = "0.123!!" if width < 150 else "0.123 ±0.010!!"
    for part in ("alarms: 5, 4 not acknowledged", "!! 4.k1 alarm, active", "valid green", "! watch yellow", "+sd",
                 "a acknowledge", "degraded (silent of actuator 3)", with_mark):  # fmt: skip
        assert part in text, part
    assert lines.index(next(x for x in lines if "4.k1 alarm" in x)) < lines.index(heading)
    if height >= 30:
        assert "monitor.log watch, acknowledged" in text


def test_nothing_is_said_by_colour_alone(frame):
    """Without any style the picture still tells levels and states."""
    state = Live(codecs.default())
    for number, status in enumerate(Status):
        state.update(_estimate(frame, number, 1, [0.1] * 6, status))
    state.update(_alarm(frame, "k1", level=1))
    state.update(_alarm(frame, "k2", level=2, state=4))
    text = _text(state, width=80, height=40)
    for part in ("valid", "degraded", "invalid", "not estimated", "k1 watch, active", "k2 alarm, shelved"):
        assert part in text


def test_an_alarm_that_is_not_repeated_is_not_known_any_more(frame):
    state = Live(codecs.default())
    state.update(_alarm(frame, "k1"))
    assert "0.k1 alarm" in _text(state)
    assert "0.k1 alarm, active: k" not in _text(state, now_ns=T0 + 4 * 10**9).split("actuator 0")[0]


def test_keys(frame):
    state, view = Live(codecs.default()), View()
    for number in (2, 5):
        state.update(_estimate(frame, number, 1, [0.1] * 6))
    state.update(_alarm(frame, "k1", actuator=5))
    state.update(_alarm(frame, "k2", actuator=5, state=2))
    alarms, actuators = state.alarms.known(T0), state.actuators
    assert view.press("a", alarms, actuators).cause == "k1"
    view.press("j", alarms, actuators)
    assert view.press("a", alarms, actuators) is None  # acknowledged already
    view.press("k", alarms, actuators)
    assert view.choice(alarms).cause == "k1"
    seen = []
    for _ in range(4):
        view.press("f", alarms, actuators)
        text = _text(state, view=view)
        seen.append((view.only, "\n2   linear" in text, "\n5   linear" in text))
    assert seen == [("alarms", False, True), (2, True, False), (5, False, True), (None, True, True)]
    view.press(" ", alarms, actuators)
    assert "frozen" in _text(state, view=view)
    view.press("q", [], [])
    assert view.quitting
    assert View().press("a", [], []) is None


def test_changes_become_events(frame):
    state = Live(codecs.default())
    state.update(_estimate(frame, 3, 1, [0] * 6))
    state.update(frame("Heartbeat", state=1, uptime=1))
    state.update(_estimate(frame, 3, 2, [0] * 6, Status.DEGRADED, Reason.LOST_FRAMES))
    state.update(frame("Heartbeat", state=2, uptime=2, n_lost=3, log_state=1))
    state.look(T0 + 10**10)
    text = " / ".join(event for _, event in state.events)
    assert "actuator 3: linear is degraded (lost frames)" in text
    assert "daemon is degraded / log is full / frames at the daemon: 3 lost / no heartbeat for 3 s" in text
    assert "daemon silent" in _text(state)


def test_a_forged_frame_shows_nothing(frame):
    state = Live(codecs.default())
    forged = _estimate(frame, 3, 1, [0.9] * 6)
    forged["data"][0, 20] ^= 1
    state.update(forged)
    assert not state.estimates
    assert state.n_bad == 1
    assert "nothing heard" in _text(state)


def test_a_terminal_is_left_clean_and_nothing_is_sent(frame):
    port = open_bus(parse("udp_multicast:239.74.163.44"))
    leader, follower = pty.openpty()
    command = [str(Path(sys.executable).with_name("ema")), "watch", "--bus", "udp_multicast:239.74.163.44"]
    environment = os.environ | {"TERM": "xterm", "COLUMNS": "180", "LINES": "40"}
    process = subprocess.Popen(command, stdout=follower, stderr=follower, stdin=follower, env=environment)
    os.close(follower)
    shown, received = b"", []
    try:
        os.set_blocking(leader, False)
        end = time.monotonic() + 60
        number = 0
        while b"0.123" not in shown and time.monotonic() < end and process.poll() is None:
            number += 1
            port.write(_estimate(frame, 2, number, [0.123] * 6))
            received.append(port.read(0.1))
            shown += _read(leader)
        process.send_signal(signal.SIGINT)
        assert process.wait(30) == 0
        shown += _read(leader)
    finally:
        process.kill()
        process.wait()
        os.close(leader)
        port.close()
    assert b"0.123" in shown
    assert shown.count(b"\x1b[?1049h") == shown.count(b"\x1b[?1049l") == 1  # alternate screen entered and left
    assert shown.rfind(b"\x1b[?25h") > shown.rfind(b"\x1b[?25l")  # the cursor is visible again
    assert b"Traceback" not in shown
    assert {int(i) for batch in received for i in batch["id"]} <= {int(_estimate(frame, 2, 0, [0] * 6)["id"][0])}


def _read(leader):
    data = b""
    try:
        while part := os.read(leader, 65536):
            data += part
    except OSError:
        pass
    return data
