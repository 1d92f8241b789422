from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from importlib.metadata import entry_points
from pathlib import Path

import pytest
from click.testing import CliRunner

from ema.cli import cli
from ema.core import resources
from ema.core.version import version

COMMANDS = sorted(entry.name for entry in entry_points(group="ema.commands"))


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    program = "from ema.cli import main; main()"
    return subprocess.run([sys.executable, "-c", program, *arguments], capture_output=True, text=True, timeout=120)


def test_help_lists_every_subcommand():
    result = CliRunner().invoke(cli, ["--help"])
    assert result.exit_code == 0
    for name in COMMANDS:
        assert name in result.output
    assert "..." not in result.output.partition("Commands:")[2], "a summary is cut off"


@pytest.mark.parametrize("name", ["export", "replay", "report"])
def test_a_time_is_explained_where_it_is_first_asked_for(name):
    text = " ".join(CliRunner().invoke(cli, [name, "--help"]).output.split())
    assert text.index("--start T") < text.index("seconds from the log's beginning") < text.index("likewise")


def test_the_version_is_that_of_logs():
    assert CliRunner().invoke(cli, ["--version"]).output == f"ema {version()}\n"


@pytest.mark.parametrize("chosen", [None, "4"])
def test_every_command_finds_the_linear_algebra_without_threads_unless_they_are_asked_for(chosen):
    name = "OPENBLAS_NUM_THREADS"
    environment = {key: value for key, value in os.environ.items() if key != name} | ({name: chosen} if chosen else {})
    program = f"import os, sys, ema.cli; print('numpy' in sys.modules, os.environ['{name}'])"
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", chosen or "1"]  # it is read when numpy is imported


@pytest.mark.parametrize("name", COMMANDS)
def test_every_subcommand_explains_itself_with_an_example(name):
    result = CliRunner().invoke(cli, [name, "--help"])
    assert result.exit_code == 0
    assert "Example" in result.output
    assert f"ema {name}" in result.output


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["nonsense"], "nonsense"),
        (["build"], "--config"),
        (["build", "--config", "nowhere.yaml", "--out", "x"], "nowhere.yaml"),
        (["build", "--config", "README.md", "--out", "x"], "README.md"),
        (["build", "--config", str(resources.config("builder-quick.yaml")), "--out", "README.md"], "not a bundle"),
    ],
)
def test_wrong_use_is_one_line_and_status_two(arguments, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "README.md").write_text("# not YAML: [\n")
    result = run(*arguments)
    assert result.returncode == 2
    assert result.stderr.count("\n") == 1
    assert result.stderr.startswith("ema: ")
    assert says in result.stderr
    assert "Traceback" not in result.stderr
    assert not (tmp_path / "x").exists()


INTERRUPTED_WHILE_LOADING = """
import sys
class CtrlC:
    def find_spec(self, name, path=None, target=None):
        if name == {name!r}:
            raise KeyboardInterrupt
sys.meta_path.insert(0, CtrlC())
from {module} import {function}
{function}()
"""


@pytest.mark.parametrize("name", ["click", "yaml"], ids=["the command line", "a subcommand"])
def test_an_interruption_while_all_is_still_being_loaded_is_one_line(name):
    scripts = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]["scripts"]
    module, _, function = scripts["ema"].partition(":")
    program = INTERRUPTED_WHILE_LOADING.format(name=name, module=module, function=function)
    arguments = ["identify", "--bundle", "nowhere", "nothing.csv"]
    done = subprocess.run([sys.executable, "-c", program, *arguments], capture_output=True, text=True, timeout=120)
    assert done.returncode == 130
    assert done.stderr.strip() == "ema: interrupted"
