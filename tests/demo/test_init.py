"""`ema init`: a folder from which its own README's commands work."""

from __future__ import annotations

import re

import pytest
from click.testing import CliRunner
from ema_daemon.settings import load
from ema_demo.working_folder import ROLES
from ema_offline_builder.config import Builder
from ema_simulator.scenario import Scenario

from ema.cli import cli
from ema.core import config
from ema.models.actuator import Actuator

READ = {
    "actuator.yaml": lambda path: config.load(path, Actuator),
    "builder.yaml": lambda path: config.load(path, Builder),
    "builder-quick.yaml": lambda path: config.load(path, Builder),
    "daemon.yaml": load,
    "scenario.yaml": lambda path: config.load(path, Scenario),
}


@pytest.fixture(params=sorted(ROLES))
def made(request, tmp_path):
    folder = tmp_path / "work"
    done = CliRunner().invoke(cli, ["init", request.param, str(folder)])
    assert done.exit_code == 0, done.output
    return request.param, folder, done.output


def test_every_file_is_valid_where_it_lies(made):
    _, folder, _ = made
    for path in folder.glob("*.yaml"):
        if path.name in READ:
            READ[path.name](path)
        assert "../" not in path.read_text()


def test_what_the_daemon_s_configuration_names_is_made_by_the_next_commands(made):
    role, folder, _ = made
    if (folder / "daemon.yaml").exists():
        settings = load(folder / "daemon.yaml")
        assert settings.actuators[0].bundle == str(folder / "bundle")
        assert settings.log.directory == str(folder / "log")
        assert (folder / "log").is_dir()
        assert any(command.endswith("--out bundle") for _, command in ROLES[role].steps)


def test_the_next_three_commands_are_told_and_written_down(made):
    role, folder, said = made
    assert len(ROLES[role].steps) == 3
    for _, command in ROLES[role].steps:
        assert command in said
        assert command in (folder / "README.md").read_text()
        for name in re.findall(r"[\w-]+\.yaml", command):
            assert (folder / name).is_file()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ([], "DIR"),
        (["tester"], "which folder"),
        (["pilot", "x"], "tester|integrator|analyst"),
        (["tester", "a", "b"], "tester|integrator|analyst"),
    ],
)
def test_wrong_words_are_told(words, says):
    done = CliRunner().invoke(cli, ["init", *words])
    assert done.exit_code == 2
    assert says in done.output


def test_nothing_is_written_over(tmp_path):
    (tmp_path / "mine.yaml").write_text("mine")
    done = CliRunner().invoke(cli, ["init", "tester", str(tmp_path)])
    assert done.exit_code != 0
    assert "not an empty folder" in str(done.exception)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.yaml"]
