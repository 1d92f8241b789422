"""Every signal is decided: none but SIGTERM, SIGINT and SIGPWR ends the daemon, and those end it in order."""

import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml
from ema_daemon import signals
from ema_daemon.identity import ATTACHMENT, Identity
from ema_daemon.reload import Reloader
from ema_daemon.settings import load, load_alarms, text

from ema.core import resources
from ema.log import LogReader, LogSettings, LogWriter, contents, schemas
from ema.log.segmented import SegmentedLog

EMA = Path(sys.executable).with_name("ema")
PATIENCE = 30.0  # for the log's next flush, on a busy machine [s]


class Desk:
    """What a reload asks of the alarms."""

    def __init__(self, settings):
        self.alarms = SimpleNamespace(settings=settings)

    def retake(self, settings, t_ns):
        self.alarms.settings = settings


@pytest.fixture
def reloader(write_config, coarse_bundle, tmp_path):
    thresholds = tmp_path / "alarms.yaml"
    thresholds.write_text(resources.config("alarms.yaml").read_text())
    shutil.copytree(coarse_bundle.path, tmp_path / "bundle")
    path = write_config(alarms={"file": "alarms.yaml"}, actuators={0: {"bundle": "bundle"}})
    settings = load(path)
    identity = Identity.of({0: coarse_bundle}, text(settings), text(load_alarms(settings)))
    with LogWriter(settings.log.directory, {"daemon.yaml": path}, LogSettings(keep_free=0)) as log:
        yield Reloader(settings, lambda: load(path), log, Desk(load_alarms(settings)), identity), path, log


def _change(path, **sections):
    content = yaml.safe_load(path.read_text())
    for name, values in sections.items():
        content[name] = {**content.get(name, {}), **values}
    path.write_text(yaml.safe_dump(content))


def test_what_may_change_is_taken_over(reloader):
    one, path, _ = reloader
    assert one.reload() == (True, "configuration read again: nothing has changed")
    _change(path, log={"keep_segments": 7, "flush_interval": "0.5 s"})
    taken, words = one.reload()
    assert taken
    assert words == "configuration read again: log.flush_interval 1.0 → 0.5, log.keep_segments 1000 → 7"


def test_thresholds_of_alarms_are_read_again_or_refused(reloader):
    one, path, _ = reloader
    thresholds = path.with_name("alarms.yaml")
    thresholds.write_text(thresholds.read_text().replace("hysteresis: 0.2", "hysteresis: 0.3"))
    assert one.reload() == (True, "configuration read again: alarms.yaml.hysteresis 0.2 → 0.3")
    thresholds.write_text(thresholds.read_text().replace("hysteresis: 0.3", "hysteresis: -1"))
    taken, words = one.reload()
    assert not taken
    assert "alarms.yaml: key 'hysteresis'" in words
    assert one._desk.alarms.settings.hysteresis == 0.3


def test_the_hash_of_the_configuration_is_that_of_what_was_read_again(reloader):
    one, path, log = reloader
    before = one.identity
    assert one.reload()[0]
    assert one.identity == before
    thresholds = path.with_name("alarms.yaml")
    thresholds.write_text(thresholds.read_text().replace("hysteresis: 0.2", "hysteresis: 0.3"))
    assert one.reload()[0]
    assert one.identity.configuration != before.configuration
    assert one.identity.bundles == before.bundles
    segments = path.with_name("log")
    end = time.monotonic() + PATIENCE
    while len(list(segments.glob("*.mcap"))) < 2 and time.monotonic() < end:
        log.event(contents.event(time.time_ns(), "info", "reloaded", "", None))
        time.sleep(0.1)
    log.close()
    with LogReader(max(segments.glob("*.mcap"))) as back:
        kept = back.attachments()
    told = json.loads(kept[ATTACHMENT])["configuration"]
    assert told == one.identity.configuration
    assert told == hashlib.sha256(kept["daemon.yaml"] + kept["alarms.yaml"]).hexdigest()


def test_a_bundle_that_is_another_one_now_is_told_and_nothing_is_taken_over(reloader):
    one, path, _ = reloader
    manifest = path.with_name("bundle") / "manifest.json"
    sound = manifest.read_text()
    manifest.write_text(json.dumps(json.loads(sound) | {"builder_hash": "another"}))
    thresholds = path.with_name("alarms.yaml")
    thresholds.write_text(thresholds.read_text().replace("hysteresis: 0.2", "hysteresis: 0.3"))
    taken, words = one.reload()
    assert not taken
    assert "bundle holds another bundle than the one in use (restart it)" in words
    assert one._desk.alarms.settings.hysteresis == 0.2
    manifest.write_text("{")
    taken, words = one.reload()
    assert not taken
    assert "manifest.json: is damaged" in words
    manifest.write_text(sound)
    assert one.reload()[0]


@pytest.mark.parametrize(
    ("section", "values", "words"),
    [
        ("log", {"directory": "elsewhere", "keep_segments": 5}, "log.directory cannot change while it runs"),
        ("bus", {"interface": "udp_multicast"}, "bus.interface cannot change while it runs"),
        ("monitor", {"timeout": "0.5 s"}, "monitor.timeout cannot change while it runs"),
        ("log", {"keep_segments": -1}, "log.keep_segments"),
    ],
)
def test_what_cannot_change_is_refused_in_words_and_nothing_is_taken_over(reloader, section, values, words):
    one, path, log = reloader
    _change(path, **{section: values})
    taken, said = one.reload()
    assert not taken
    assert "configuration not taken over, it goes on as before" in said
    assert words in said
    assert log._log.settings.keep_segments == 1000


def test_a_new_segment_carries_the_configuration_that_holds_from_there_on(tmp_path):
    log = SegmentedLog(tmp_path, {"daemon.yaml": b"old"}, LogSettings(keep_free=0), 10**18, 0.0)
    log.write(schemas.EVENT.encode({"t_ns": 10**18, "level": "info", "code": "x", "text": "1", "actuator": None}))
    log.cut(LogSettings(keep_free=0, keep_segments=9), {"daemon.yaml": b"new"})
    log.tick(10**18, 1.0)
    log.write(schemas.EVENT.encode({"t_ns": 10**18, "level": "info", "code": "x", "text": "2", "actuator": None}))
    log.close()
    first, second = sorted(tmp_path.iterdir())
    for path, configuration, said in ((first, b"old", "1"), (second, b"new", "2")):
        with LogReader(path) as back:
            assert back.attachments()["daemon.yaml"] == configuration
            assert [m.content["text"] for m in back.messages()] == [said]


def test_no_signal_ends_the_daemon_but_those_that_stop_it_in_order(write_config, tmp_path):
    bus = {"interface": "udp_multicast", "channel": f"239.74.{os.getpid() % 200}.{os.getpid() // 200 % 200}"}
    config = write_config(bus=bus, log={"directory": "log", "flush_interval": "0.1 s"})
    process = subprocess.Popen([EMA, "daemon", "--config", config], stderr=subprocess.PIPE, text=True)
    said = []

    def heard(what):
        for line in process.stderr:
            said.append(line)
            if what in line:
                return

    try:
        heard("udp_multicast")
        time.sleep(0.5)
        for number in (signal.SIGUSR1, signal.SIGUSR2, signal.SIGQUIT, *signals.IGNORED[:6]):
            process.send_signal(number)
        heard("the log begins a new segment")
        _change(config, log={"directory": "log", "keep_segments": 4})
        process.send_signal(signal.SIGHUP)
        heard("log.keep_segments 1000 → 4")
        _change(config, log={"directory": "other"})
        process.send_signal(signal.SIGHUP)
        heard("log.directory cannot change while it runs")
        assert process.poll() is None
        process.send_signal(signal.SIGPWR)
        said.append(process.communicate(timeout=60)[1])
    finally:
        process.kill()
        process.wait()
    assert process.returncode == 0
    assert "Current thread" in "".join(said)  # SIGQUIT's stacks
    assert "Traceback" not in "".join(said)
    with LogReader(tmp_path / "log") as log:
        assert len(log.paths) > 1
        codes = [m.content["code"] for m in log.messages(lambda topic: topic == "/event")]
        assert log.complaints() == []
    assert {"log_cut", "state", "reloaded", "reload_refused"} <= set(codes)
    assert codes[-1] == "stopped"
