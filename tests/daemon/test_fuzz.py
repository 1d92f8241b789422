"""Arbitrary configurations, and noise on the bus for a long while: an answer or one line; memory does not grow."""

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from ema_daemon import settings as daemon
from ema_simulator import scenario
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ema.bus import codec as codecs
from ema.bus.authentication import Verifier
from ema.core import frames as fr
from ema.core import resources
from ema.core.errors import ConfigError
from ema.monitor import Monitor
from ema.monitor.settings import MonitorSettings

FUZZ = settings(max_examples=100, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
READERS = [(daemon.load, "daemon.yaml"), (scenario.load, "scenario-bad-bus.yaml")]
LAUGHS = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{new}: &{new} [{', '.join(9 * [f'*{old}'])}]\n" for old, new in zip("abcdefgh", "bcdefghi", strict=True)
)


def refused_in_one_line_or_read(load, path, text):
    path.write_bytes(text.encode(errors="surrogateescape"))
    said = ""
    try:
        load(path)
    except ConfigError as error:
        said = str(error)
    assert "\n" not in said
    assert len(said) < 2000


@pytest.mark.parametrize(("load", "name"), READERS)
@FUZZ
@given(text=st.text(max_size=200))
def test_any_text_as_configuration(tmp_path_factory, load, name, text):
    refused_in_one_line_or_read(load, tmp_path_factory.getbasetemp() / name, text)


@pytest.mark.parametrize(("load", "name"), READERS)
@FUZZ
@given(
    data=st.data(),
    patch=st.sampled_from(
        [*"{}[]:-&*!|>#%@,'\"\\\t\n", "1e999", "-1", "null", "true", ".nan", "0x", "9" * 400, "é\0", "9**9**9**9 s"]
    ),
)
def test_a_sound_configuration_written_over(tmp_path_factory, load, name, data, patch):
    text = Path(resources.config(name)).read_text()
    begin = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(begin, min(len(text), begin + 12)))
    refused_in_one_line_or_read(load, tmp_path_factory.getbasetemp() / name, text[:begin] + patch + text[end:])


@pytest.mark.parametrize(("load", "name"), READERS)
@pytest.mark.parametrize("text", [LAUGHS, LAUGHS + "actuators: *i\n", "a: &a [*a]", "[" * 400, "a: " * 3000])
def test_a_configuration_that_would_blow_up(tmp_path, load, name, text):
    refused_in_one_line_or_read(load, tmp_path / name, text)


@pytest.mark.parametrize("with_key", [False, True])
def test_memory_does_not_grow_with_noise_on_the_bus(coarse_bundle, with_key):
    """Frames of every message and actuator with random contents; half of them pass the CRC as their sender's."""
    codec, rng = codecs.default(), np.random.default_rng(4)
    monitor = Monitor({0: coarse_bundle, 1: coarse_bundle}, codec, MonitorSettings())
    verifier = Verifier(codec, bytes(16))
    ids = np.array([m.frame_id | n << 2 for m in codec.messages.values() for n in range(64)])
    lengths = np.array([m.length for m in codec.messages.values() for _ in range(64)])

    def some(n):
        frames, chosen = fr.empty(500), rng.integers(0, ids.size, 500)
        frames["id"], frames["length"], frames["flags"] = ids[chosen], lengths[chosen], 9
        frames["data"] = rng.integers(0, 256, (500, 64))
        frames["t_ns"] = 10**18 + n * 10**8 + np.arange(500) * 10**5
        return verifier.feed(frames, 0) if with_key else frames

    for n in range(20):
        monitor.update(some(n))
    tracemalloc.start()
    try:
        for n in range(20, 60):
            monitor.update(some(n))
        before = tracemalloc.get_traced_memory()[0]
        for n in range(60, 140):
            monitor.update(some(n))
        assert tracemalloc.get_traced_memory()[0] - before < 100_000
    finally:
        tracemalloc.stop()
