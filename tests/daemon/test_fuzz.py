"""Arbitrary configurations, and noise on the bus for a long while: an answer or one line; memory does not grow."""

import copy
import math
import operator
import re
import tracemalloc
from functools import partial, reduce
from pathlib import Path

import numpy as np
import pytest
import yaml
from ema_daemon import settings as daemon
from ema_offline_builder.config import Builder
from ema_simulator import scenario
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ema.bus import codec as codecs
from ema.bus.keys import Keyring
from ema.bus.verifier import Verifier
from ema.core import config, resources
from ema.core import frames as fr
from ema.core.errors import ConfigError
from ema.models.actuator import Actuator
from ema.monitor import Monitor
from ema.monitor.settings import MonitorSettings

FUZZ = settings(max_examples=100, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
READERS = [(daemon.load, "daemon.yaml"), (scenario.load, "scenario-bad-bus.yaml")]
EVERY_READER = [
    *READERS,
    (scenario.load, "scenario.yaml"),
    (partial(config.load, kind=Builder), "builder.yaml"),
    (partial(config.load, kind=Actuator), "actuator.yaml"),
]
ODD = (math.nan, math.inf, -math.inf, 0, -1, 1e300, "", "text", None, True, [], {}, [math.nan], [1], {"a": 1})
TOO_LONG_FOR = {"return_time": "period"}  # and then refused in that key's name
LAUGHS = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{new}: &{new} [{', '.join(9 * [f'*{old}'])}]\n" for old, new in zip("abcdefgh", "bcdefghi", strict=True)
)


def refusal(load, path):
    """What is said of a configuration; None if it is read."""
    try:
        load(path)
    except ConfigError as error:
        return str(error)
    return None


def refused_in_one_line_or_read(load, path, text):
    path.write_bytes(text.encode(errors="surrogateescape"))
    said = refusal(load, path)
    if said is None:
        return
    assert said.startswith(str(path))
    what = said.removeprefix(str(path))
    assert re.match(r": key '|: must be a mapping|: is not UTF-8|(, line \d+)?: is not valid YAML", what)
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


def places(node, at=()):
    """Every key and item of a configuration, as a path."""
    if at:
        yield at
    pairs = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in pairs:
        yield from places(value, (*at, key))


@pytest.mark.parametrize(("load", "name"), EVERY_READER, ids=[name for _, name in EVERY_READER])
def test_any_value_of_any_key_is_read_or_refused_by_its_name(tmp_path, load, name):
    sound, path = yaml.safe_load(Path(resources.config(name)).read_text()), tmp_path / name
    path.write_text(yaml.safe_dump(sound))
    assert refusal(load, path) is None
    n_refused = 0
    for at in places(sound):
        key = next(part for part in reversed(at) if isinstance(part, str))
        *way, last = at
        for odd in ODD:
            changed = copy.deepcopy(sound)
            reduce(operator.getitem, way, changed)[last] = odd
            path.write_text(yaml.safe_dump(changed))
            said = refusal(load, path)
            if said is None or (at == ("actuator",) and "cannot be read" in said):  # names the plant's file instead
                continue
            n_refused += 1
            assert "\n" not in said
            assert said.startswith(f"{path}: "), (at, odd)
            named = said.removeprefix(str(path))
            assert key in named or f"key '{TOO_LONG_FOR.get(key)}'" in named, (at, odd, said)
    assert n_refused > len(list(places(sound)))  # of each key more than one value is wrong


@pytest.mark.parametrize("with_key", [False, True])
def test_memory_does_not_grow_with_noise_on_the_bus(coarse_bundle, with_key):
    """Frames of every message and actuator with random contents; half of them pass the CRC as their sender's."""
    codec, rng = codecs.default(), np.random.default_rng(4)
    monitor = Monitor({0: coarse_bundle, 1: coarse_bundle}, codec, MonitorSettings())
    verifier = Verifier(codec, Keyring({None: [bytes(16)]}))
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
