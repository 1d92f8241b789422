import json

import pytest
import yaml
from click.testing import CliRunner
from ema_daemon import checkup
from ema_daemon.doctor import doctor

from ema.core.errors import NegativeAnswer

NOT_TO_BE_KNOWN = ("its limit cannot be read", "whether it is synchronised cannot be asked")


def _run(*arguments):
    return CliRunner().invoke(doctor, [str(a) for a in arguments])


def _findings(*arguments):
    return {one["what"]: one for one in json.loads(_run(*arguments, "--json").stdout)}


@pytest.fixture
def configuration(coarse_bundle, tmp_path):
    (tmp_path / "log").mkdir()
    content = {
        "bus": {"interface": "virtual", "channel": "doctor"},
        "actuators": {0: {"bundle": str(coarse_bundle.path)}},
        "log": {"directory": "log", "keep_free": "0.001 MB"},
    }
    path = tmp_path / "daemon.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def test_a_machine_is_described():
    found = _findings("--bus", "virtual:doctor")
    assert "ema-monitor" in found["software"]["found"]
    assert found["bus"]["verdict"] == "ok"
    assert {"kernel CAN", "receive buffer", "clock", "machine", "service manager"} <= found.keys()
    for one in found.values():
        wants_remedy = one["verdict"] != "ok" and one["found"] not in NOT_TO_BE_KNOWN
        assert bool(one["remedy"]) == wants_remedy, one


def test_a_configuration_that_works(configuration):
    answer = _run("--config", configuration)
    assert answer.exit_code == 0, answer.output
    for part in ("bus: ", "virtual:doctor", "bundles: ", "log directory: "):
        assert part in answer.output, part


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"actuators": {0: {"bundle": "absent"}}}, "bundles"),
        ({"log": {"directory": "absent"}}, "log directory"),
        ({"log": {"directory": "log", "keep_free": "1e12 MB"}}, "log directory"),
        ({"bus": {"interface": "socketcan", "channel": "absent0"}}, "bus"),
        ({"colour": "red"}, "configuration"),
    ],
)
def test_what_would_not_work_is_a_negative_answer_with_a_remedy(configuration, change, what):
    configuration.write_text(yaml.safe_dump(yaml.safe_load(configuration.read_text()) | change))
    answer = _run("--config", configuration, *(["--bus", "virtual:doctor"] if what != "bus" else []))
    assert isinstance(answer.exception, NegativeAnswer)
    assert what in str(answer.exception)
    assert "→" in answer.output


def test_a_small_receive_buffer_and_a_lost_clock_are_told_with_the_remedy(monkeypatch):
    monkeypatch.setattr(checkup, "_read", lambda path: "212992")
    finding = checkup._buffer()
    assert finding.verdict == "warning"
    assert "sysctl net.core.rmem_max=" in finding.remedy
