"""Alarms in the daemon's loop: on the bus, in log and journal, after a restart, and again from the log to the bit."""

from __future__ import annotations

import json
import socket

import numpy as np
import pytest
import yaml
from desks import loop
from ema_daemon.alarming import MESSAGE_ID
from ema_daemon.journal import JournalHandler
from ema_daemon.state_file import StateFile
from ema_daemon.worker import Worker
from ema_postflight.alarms_again import AlarmComparison
from ema_postflight.identify import identified, setup

from ema.alarms import Action, AlarmSettings
from ema.alarms.bus import COMMAND, AlarmListener, Ears, command_values
from ema.bus import codec as codecs
from ema.bus.keys import Keyring
from ema.bus.protection import Sender
from ema.bus.sealer import Sealer
from ema.bus.sessions import Sessions
from ema.bus.verifier import Verifier
from ema.core import frames as fr
from ema.core.status import AlarmLevel, AlarmState
from ema.log import LogReader, LogWriter, schemas
from ema.monitor import Monitor, MonitorSettings, Runner

CODEC = codecs.default()
LOW = {"watch": 0.015, "alarm": 0.04}
THRESHOLDS = {"faults": {f"k{j}": LOW for j in range(1, 7)}}
SETTINGS = MonitorSettings.model_validate({"slower": {"lf2": {"every": "2 s"}}})


@pytest.fixture(scope="module")
def flight(fly):
    """Eight cycles, in which dry friction grows past both setpoints."""
    ramp = {"ramp": {"duration": "8 s", "initial": 0.01, "final": 0.09}}
    return np.concatenate([f for _, f in fly(n_cycles=8, seed=5, actuators=[{"faults": {"k1": ramp}}])])


def command(action, cause, t_ns, duration=0.0, sender=None):
    """As `ema alarm` sends it: twice, the first to say that there is a new sender."""
    frames = CODEC.encode(COMMAND, 0, command_values(action, cause, duration, CODEC), t_ns)
    return (sender or Sender()).protect(np.repeat(frames, 2))


def with_command(flight, at, action, cause="k1", duration=0.0):
    """The flight with a command among its frames."""
    return fr.joined([flight[:at], command(action, cause, int(flight["t_ns"][at]), duration), flight[at:]])


@pytest.fixture
def flown(coarse_bundle, scripted, tmp_path):
    """The loop on frames in batches of n; port and log folder."""

    def go(frames, n=97, folder=tmp_path, halfway=None):
        batches = [frames[i : i + n] for i in range(0, frames.size, n)]
        if halfway:
            batches.insert(len(batches) // 2, lambda port: halfway(service))
        monitor = Monitor({0: coarse_bundle}, CODEC, SETTINGS)
        port = scripted(batches, lambda: service.stop())
        configured = {
            "actuators": {0: {"bundle": str(coarse_bundle.path)}},
            "monitor": SETTINGS.model_dump(mode="json"),
        }
        attachments = {
            "daemon.yaml": yaml.safe_dump(configured).encode(),
            "manifest.json": json.dumps(coarse_bundle.manifest).encode(),
            "alarms.yaml": yaml.safe_dump(shipped_with(THRESHOLDS)).encode(),
        }
        worker = Worker(Runner({0: coarse_bundle}).run, 8, "lf2")
        with (
            LogWriter(folder, attachments) as log,
            loop(monitor, port, log, {"lf2": worker}, folder, **THRESHOLDS) as service,
        ):
            service.run()
        return port

    return go


def shipped_with(changes):
    from ema.core import config, resources

    return config.read_yaml(resources.config("alarms.yaml")) | changes


def alarms_in(folder):
    with LogReader(folder) as log:
        return [m.content for m in log.messages(lambda topic: topic == schemas.ALARM.topic)]


def story(folder, cause="k1"):
    return [(a["level"], a["state"]) for a in alarms_in(folder) if a["cause"] == cause]


def test_the_bus_says_what_the_log_says(flown, flight, tmp_path):
    port = flown(flight)
    listener = AlarmListener(CODEC)
    heard = [(c.cause, c.level.name.lower(), c.state.name.lower()) for b in port.written for c in listener.update(b)]
    logged = [(a["cause"], a["level"], a["state"]) for a in alarms_in(tmp_path)]
    assert heard == logged
    assert story(tmp_path)[-1] == ("alarm", "active")
    k1 = listener.find(0, "k1")
    assert (k1.level, k1.state) == (AlarmLevel.ALARM, AlarmState.ACTIVE)
    assert k1.measure.limit == pytest.approx(LOW["alarm"])
    assert LOW["alarm"] <= k1.measure.low <= k1.measure.value


def test_what_stands_is_repeated_and_who_has_none_says_so(flown, flight):
    port = flown(flight)
    alarms = port.sent("Alarm")
    beats = len(port.sent("Heartbeat")["state"])
    names = CODEC.messages["Alarm"].fields["cause"].names
    assert beats >= 2
    assert "none" in {names[int(cause)] for cause in alarms["cause"]} | {"none"}
    assert sum(names[int(cause)] == "k1" for cause in alarms["cause"]) >= 3  # at its changes and with the last beat


def test_commands_from_the_bus_are_done(flown, flight, tmp_path):
    flown(with_command(flight, flight.size - 100, Action.ACK))
    assert story(tmp_path)[-2:] == [("alarm", "active"), ("alarm", "acknowledged")]


def test_states_survive_a_restart(flown, flight, tmp_path):
    flown(with_command(flight, flight.size - 100, Action.ACK))
    n_before = len(alarms_in(tmp_path))
    port = flown(flight[:1])
    assert len(alarms_in(tmp_path)) == n_before
    listener = AlarmListener(CODEC)
    for batch in port.written:
        listener.update(batch)
    assert listener.find(0, "k1").state == AlarmState.ACKNOWLEDGED


def test_a_state_file_that_cannot_be_used_is_kept_and_said(flown, flight, tmp_path, caplog):
    (tmp_path / "alarms.json").write_text('{"version": 1, "points": [[0,')
    flown(flight[:1])
    assert (tmp_path / "alarms.json.damaged").read_text() == '{"version": 1, "points": [[0,'
    assert "alarms begin anew" in caplog.text
    assert json.loads((tmp_path / "alarms.json").read_text())["version"] == 1


@pytest.mark.parametrize("n", [31, 500])
def test_a_replay_gives_the_same_changes_to_the_bit(flown, flight, tmp_path, n):
    acked = with_command(flight, flight.size // 2, Action.SHELVE, duration=60.0)
    flown(with_command(acked, acked.size - 100, Action.ACK), n)
    flown(flight[:1])  # a second start, which goes on from the state file
    counts = again(tmp_path)
    assert counts["n_only_logged"] == counts["n_only_again"] == 0
    assert counts["n_equal"] >= 3


def test_thresholds_changed_while_it_runs_hold_from_there_on_and_in_a_replay(flown, flight, tmp_path):
    high = {"faults": {f"k{j}": {"watch": 0.5, "alarm": 0.9} for j in range(1, 7)}}
    changed = AlarmSettings.model_validate(shipped_with(THRESHOLDS | high))

    class Reload:
        identity = None  # of a loop without one

        def __init__(self, service):
            self.log, self.desk = service.log, service.desk

        def reload(self):
            self.log.cut()
            self.desk.retake(changed, int(flight["t_ns"][flight.size // 2]))
            return True, "changed"

    flown(flight, n=31, halfway=lambda service: service.ask(lambda: service.reload(Reload(service))))
    assert ("watch", "active") in story(tmp_path)
    assert story(tmp_path)[-1] == ("watch", "latched_cleared")  # it stands until somebody has acknowledged it
    assert ("alarm", "active") not in story(tmp_path)
    counts = again(tmp_path)
    assert counts["n_only_logged"] == counts["n_only_again"] == 0
    assert counts["n_equal"] >= 2


def again(folder):
    """How many changes in a log are made again from it."""
    comparison = AlarmComparison()
    with LogReader(folder) as log:
        for item in identified(log, setup(log, ()), n_processes=1):
            if getattr(item, "topic", "") == schemas.ALARM.topic:
                if hasattr(item, "content"):
                    comparison.logged(item.content)
                else:
                    comparison.again(json.loads(item.data))
    return comparison.counts


def test_where_keys_are_configured_a_command_needs_its_seal(tmp_path):
    t_ns, ring = 1_790_000_000_000_000_000, Keyring({None: [bytes(range(16))]})
    sealer, verifier = Sealer(CODEC, ring, Sessions(tmp_path / "sessions")), Verifier(CODEC, ring, "Monitor")
    sender = Sender()

    def heard(seal=True):
        frames = command(Action.ACK, "k1", t_ns, sender=sender)
        sent = fr.joined([frames, sealer.add(frames)]) if seal else frames
        sent["t_ns"] = t_ns
        decided = fr.joined([verifier.feed(sent, t_ns), verifier.feed(fr.empty(0), t_ns + 10**10)])
        return len(Ears(CODEC, [0]).hear(decided))

    assert heard() == 0  # who this is has to be asked first
    verifier.feed(sealer.hear(verifier.ask(t_ns), t_ns), t_ns)
    assert heard() == 2
    assert heard(seal=False) == 0


def test_a_line_of_the_journal_has_a_message_id(tmp_path):
    import logging

    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as journal:
        journal.bind(str(tmp_path / "journal"))
        handler = JournalHandler(tmp_path / "journal")
        record = logging.LogRecord("ema", logging.ERROR, "", 0, "actuator 0: %s", ("alarm\nMESSAGE_ID=forged",), None)
        record.journal = {"MESSAGE_ID": MESSAGE_ID, "EMA_CAUSE": "k1"}
        handler.emit(record)
        handler.close()
        lines = journal.recv(4096).decode().splitlines()
    assert f"MESSAGE_ID={MESSAGE_ID}" in lines
    assert "PRIORITY=3" in lines
    assert not any(line.startswith("MESSAGE_ID=forged") for line in lines)


def test_a_state_file_is_replaced_as_a_whole(tmp_path):
    with StateFile(tmp_path / "alarms.json") as state:
        for n in range(20):
            state.save({"n": n})
    assert StateFile(tmp_path / "alarms.json").load() == {"n": 19}
    assert not (tmp_path / "alarms.json.part").exists()
