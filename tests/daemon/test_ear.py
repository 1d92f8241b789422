"""The bus is listened to from before the rest is loaded, so that another monitor is heard whatever loading takes."""

from __future__ import annotations

import time

import numpy as np
import pytest
from ema_daemon.assembly import assembled
from ema_daemon.ear import Ear, load_bus
from ema_daemon.settings import load

from ema.bus.codec import default
from ema.bus.interface import open_bus
from ema.bus.protection import Sender
from ema.core.errors import ConfigError, OccupiedError
from ema.core.frames import joined

CODEC = default()
PATIENCE = 30.0  # for another thread on a busy machine [s]


def signs_of_life(watched):
    sender = Sender()
    heartbeat = dict.fromkeys(CODEC.messages["Heartbeat"].fields, 0)
    supervision = {"reasons": 0, "concerned": np.uint64(0), "watched": np.uint64(sum(1 << n for n in watched))}
    frames = [CODEC.encode("Heartbeat", 0, heartbeat), CODEC.encode("Supervision", 0, supervision)]
    return sender.protect(joined(frames))


@pytest.fixture
def settings(write_config, tmp_path):
    bus = {"interface": "virtual", "channel": tmp_path.name}
    return load(write_config(bus=bus, supervision={"listen": "0.2 s"}))


@pytest.fixture
def others(settings):
    """Whoever else is on the bus."""
    with open_bus(settings.bus) as port:
        yield port


def until_heard(ear, n):
    end = time.monotonic() + PATIENCE
    while ear.port.counters.n_received < n:
        assert time.monotonic() < end
        time.sleep(0.01)


def test_it_keeps_what_monitors_say_and_lets_the_rest_go(settings, others):
    supply = Sender().protect(CODEC.encode("Supply", 3, {"u_dc": [48.0], "temp_w": 20.0}))
    with Ear(settings.bus) as ear:
        before = time.monotonic()
        others.write(joined([supply, signs_of_life([0]), supply]))
        until_heard(ear, 4)
        heard = ear.end()
    assert joined([frames for _, frames in heard])["id"].tolist() == signs_of_life([0])["id"].tolist()
    assert all(before <= at <= time.monotonic() for at, _ in heard)


def test_a_monitor_heard_while_loading_is_a_reason_not_to_start(settings, others):
    with Ear(settings.bus) as ear:
        others.write(signs_of_life([0]))
        until_heard(ear, 2)
        time.sleep(0.3)
        with assembled(settings, ear) as service:
            service.ask(service.stop)
            with pytest.raises(OccupiedError, match="watches actuator 0 already"):
                service.run()


def test_listening_counts_from_the_opening_of_the_bus(settings, others):
    """Alone, it speaks as soon as it has listened long enough, however much of that was loading."""
    with Ear(settings.bus) as ear:
        time.sleep(0.3)
        with assembled(settings, ear) as service:
            service.ask(service.stop)
            service.run()
    assert (others.read(PATIENCE)["id"] == CODEC.messages["Heartbeat"].frame_id).any()


def test_the_bus_is_read_of_a_configuration_whose_other_sections_are_not_looked_at(write_config, tmp_path):
    path = write_config(bus={"interface": "virtual", "key_file": "bus.key"}, colour="blue")
    assert load_bus(path).key_file == tmp_path / "bus.key"
    assert load_bus(write_config(bus=None)).interface == "auto"


def test_a_bus_section_that_cannot_be_used_is_refused_as_with_the_whole(write_config):
    path = write_config(bus={"interface": 3, "colour": "blue"})
    with pytest.raises(ConfigError) as alone:
        load_bus(path)
    with pytest.raises(ConfigError) as whole:
        load(path)
    assert str(alone.value) == str(whole.value)
