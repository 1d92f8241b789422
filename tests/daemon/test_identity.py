"""Which software, bundle and configuration make the estimates is on the bus and in every log."""

import hashlib
import json
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from ema_daemon.assembly import assembled
from ema_daemon.identity import ATTACHMENT, Identity
from ema_daemon.reload import Reloader
from ema_daemon.settings import load

from ema.bus.codec import default
from ema.bus.interface import open_bus
from ema.core import resources
from ema.core.version import version
from ema.log import LogReader


def told(identity, actuator):
    message = default().messages["Identification"]
    frame = default().encode(message.name, actuator, identity.signals(actuator))
    return {name: value[0] for name, value in message.decode(frame).items()}


def hexadecimal(words):
    return "".join(f"{int(word):016x}" for word in np.atleast_1d(words))


def test_the_frame_says_what_the_log_says(coarse_bundle):
    other = replace(coarse_bundle, signed_by="ab" * 32)
    identity = Identity.of({0: coarse_bundle, 7: other}, b"a: 1\n")
    kept = json.loads(identity.as_json())
    for actuator in (0, 7):
        said, bundle = told(identity, actuator), kept["bundles"][str(actuator)]
        assert bundle["sha256"].startswith(hexadecimal(said["bundle"]))
        assert hexadecimal(said["signer"]) == (bundle["signed_by"] or "0" * 16)[:16]
        assert kept["configuration"] == hashlib.sha256(b"a: 1\n").hexdigest()
        assert kept["configuration"].startswith(hexadecimal(said["configuration"]))
    assert kept["software"] == version()


@pytest.mark.parametrize(
    ("software", "expected"),
    [
        ("0.1.0+g25b3386e6.dirty", (0, 1, 0, 0x25B3386E6, 1)),
        ("1.20.3+g25b3386e6", (1, 20, 3, 0x25B3386E6, 0)),
        ("2.0.1", (2, 0, 1, 0, 0)),
        ("unknown", (0, 0, 0, 0, 0)),
    ],
)
def test_versions_as_numbers(coarse_bundle, software, expected):
    said = told(replace(Identity.of({0: coarse_bundle}, b""), software=software), 0)
    assert tuple(int(said[name]) for name in ("major", "minor", "patch", "commit", "changed")) == expected


def test_another_array_is_another_bundle(coarse_bundle):
    manifest = json.loads(json.dumps(coarse_bundle.manifest))
    manifest["arrays"]["A"]["sha256"] = "0" * 64
    assert replace(coarse_bundle, manifest=manifest).sha256 != coarse_bundle.sha256


def test_the_daemon_tells_it_at_its_start_and_in_its_log(write_config, coarse_bundle, tmp_path):
    settings = load(write_config(bus={"interface": "virtual", "channel": "identity"}))
    message, heard = default().messages["Identification"], []
    with open_bus(settings.bus) as listener, assembled(settings) as service:
        thread = threading.Thread(target=service.run)
        thread.start()
        end = time.monotonic() + 30
        while time.monotonic() < end and not heard:
            frames = listener.read(0.1)
            heard = [frame for frame in frames if frame["id"] == message.frame_id]
        service.stop()
        thread.join(30)
    with LogReader(tmp_path / "log") as log:
        kept = json.loads(log.attachments()[ATTACHMENT])
    assert kept["bundles"]["0"]["sha256"] == coarse_bundle.sha256
    assert coarse_bundle.sha256.startswith(hexadecimal(message.decode(np.array(heard))["bundle"][0]))


def test_thresholds_read_again_are_another_configuration_on_the_bus_at_once(write_config, tmp_path):
    thresholds = tmp_path / "alarms.yaml"
    thresholds.write_text(resources.config("alarms.yaml").read_text())
    bus = {"interface": "virtual", "channel": "identity-again"}
    path = write_config(bus=bus, alarms={"file": "alarms.yaml"}, supervision={"listen": 0.0})
    settings, message = load(path), default().messages["Identification"]

    def told_next(listener):
        end = time.monotonic() + 30
        while time.monotonic() < end:
            frames = listener.read(0.1)
            heard = message.decode(frames[frames["id"] == message.frame_id])["configuration"]
            if heard.size:
                return hexadecimal(heard[0])
        raise AssertionError("no Identification")

    with open_bus(settings.bus) as listener, assembled(settings) as service:
        before = service.identity.configuration
        reloader = Reloader(settings, lambda: load(path), service.log, service.desk, service.identity)
        thread = threading.Thread(target=service.run)
        thread.start()
        assert before.startswith(told_next(listener))
        thresholds.write_text(thresholds.read_text().replace("hysteresis: 0.2", "hysteresis: 0.3"))
        service.ask(lambda: service.reload(reloader))
        assert told_next(listener) not in before  # well before the ten seconds after which it is told again anyway
        service.stop()
        thread.join(30)
