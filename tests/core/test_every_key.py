"""Every numeric key of every configuration: what is no number in its range is refused in one line that says so."""

from __future__ import annotations

import copy
import math

import pytest
from ema_daemon.settings import DaemonSettings
from ema_offline_builder.config import Builder
from ema_postflight.report_settings import ReportSettings
from ema_simulator.scenario import Scenario

from ema.alarms import AlarmSettings
from ema.core import config, resources
from ema.core.config import Settings
from ema.core.errors import ConfigError
from ema.models.actuator import Actuator

NO_NUMBER = {
    "nan": math.nan,
    "inf": math.inf,
    "-inf": -math.inf,
    "huge": 1e300,
    "negative huge": -1e300,
    "text": "many",
    "wrong unit": "3 kg K mol",
    "list": [1.0, 2.0],
    "mapping": {"a": 1},
    "true": True,
}
# Beside what is shipped: keys that are left out there, and one of each section that a list may hold.
MORE = {
    "actuator.yaml": {"transmission": {"F_u": 3.0}},
    "scenario.yaml": {
        "n_cycles": 5,
        "disturbances": {"gaps": [{"cycle": 2, "start": 0.2, "duration": 0.05}]},
        "actuators": [
            {"number": 1, "faults": {"k1": {"ramp": {"duration": 3.0, "final": 0.2}}, "k2": [[0.0, 0.0], [1.0, 0.1]]}},
            {"number": 2, "faults": {"k6": {"exponential": {"time_constant": 3.0, "initial": 0.1, "limit": 0.2}}}},
        ],
    },
    "daemon.yaml": {
        "actuators": {0: {"bundle": "bundle"}},
        "remote": {"hf": "hf.sock"},
        "monitor": {"slower": {"lf2": {"every": 5.0}, "hf": {"every": 60.0}}},
    },
}
FILES = {
    "actuator.yaml": Actuator,
    "builder.yaml": Builder,
    "scenario.yaml": Scenario,
    "daemon.yaml": DaemonSettings,
    "report.yaml": ReportSettings,
    "alarms.yaml": AlarmSettings,
}


def merged(old, new):
    if isinstance(old, dict) and isinstance(new, dict):
        return {**old, **{key: merged(old.get(key), value) for key, value in new.items()}}
    return new


def whole(name, kind):
    """A valid configuration with every key said."""
    data = merged(config.read_yaml(resources.config(name)), MORE.get(name, {}))
    return config.validate(data, kind, name).model_dump(mode="python", exclude_none=True)


def leaves(data, path=()):
    """Paths of all numbers."""
    if isinstance(data, dict | list | tuple):
        items = data.items() if isinstance(data, dict) else enumerate(data)
        for key, value in items:
            yield from leaves(value, (*path, key))
    elif isinstance(data, int | float) and not isinstance(data, bool):
        yield path


def with_value(data, path, value):
    changed = copy.deepcopy(data)
    place = changed = plain(changed)
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return changed


def plain(data):
    if isinstance(data, dict):
        return {key: plain(value) for key, value in data.items()}
    return [plain(value) for value in data] if isinstance(data, list | tuple) else data


def refusals(name, kind: type[Settings]):
    data = whole(name, kind)
    config.validate(plain(data), kind, name)
    for path in leaves(data):
        for what, value in NO_NUMBER.items():
            yield path, what, with_value(data, path, value)


@pytest.mark.parametrize("name", [name for name, kind in FILES.items() if kind])
def test_what_is_no_number_in_its_range_is_refused_by_file_key_and_value(name):
    kind, accepted = FILES[name], []
    n = 0
    for path, what, data in refusals(name, kind):
        n += 1
        try:
            config.validate(data, kind, f"folder/{name}")
        except ConfigError as error:
            message = str(error)
            assert "\n" not in message
            assert message.startswith(f"folder/{name}: ")
            assert any(isinstance(key, str) and key in message for key in path), (path, message)
        else:
            accepted.append((".".join(map(str, path)), what))
    assert n > 10 * 10
    assert accepted == [], accepted
