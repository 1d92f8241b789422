"""A part's packages come with its extra; what is not installed is said in one line."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from importlib.metadata import entry_points
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
# What the onboard computer's environment does not hold, by the names under which it is imported.
NOT_THE_MONITORS = ("numba", "llvmlite", "minisom", "matplotlib", "jinja2", "pandas", "pyarrow", "distributed", "dask")
LIGHT = ("asammdf", "h5py", "foxglove", "sklearn")


def without(modules, *words):
    """Run `ema` where these modules are not installed."""
    program = f"import sys; sys.modules.update(dict.fromkeys({modules!r})); from ema.cli import main; main()"
    return subprocess.run([sys.executable, "-c", program, *words], capture_output=True, text=True, timeout=120)


@pytest.mark.parametrize("entry", entry_points(group="ema.commands"), ids=lambda entry: entry.name)
def test_a_command_names_an_extra_that_there_is(entry):
    assert set(entry.extras) <= set(EXTRAS)


@pytest.mark.parametrize(
    ("words", "missing", "extra"),
    [
        (["build", "--config", "config/builder-quick.yaml", "--out", "{}/b"], "numba", "build"),
        (["simulate", "--scenario", "config/scenario.yaml", "--csv", "{}/x.csv"], "numba", "build"),
        (["alarm", "list"], "can", "monitor"),
    ],
)
def test_a_package_that_is_not_there_is_told_with_the_extra_that_brings_it(words, missing, extra, tmp_path):
    done = without((missing,), *[word.format(tmp_path) for word in words])
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert f"'{missing}'" in done.stderr
    assert f"ema-monitor[{extra}]" in done.stderr


def test_help_of_everything_needs_no_extra():
    done = without((*NOT_THE_MONITORS, *LIGHT, "can", "cantools", "mcap", "rich"), "--help")
    assert done.returncode == 0, done.stderr
    for entry in entry_points(group="ema.commands"):
        assert entry.name in done.stdout


@pytest.mark.parametrize("program", ["daemon", "watch", "recover"])
def test_the_monitor_s_commands_need_no_package_of_another_part(program, tmp_path):
    """Each gets as far as its own complaint about what it was given."""
    (tmp_path / "x.yaml").write_text("bus: {interface: nonsense}\nactuators: {0: {bundle: x}}\nlog: {directory: x}\n")
    words = {
        "daemon": ["--config", str(tmp_path / "x.yaml")],
        "watch": ["--bus", "nonsense"],
        "recover": [str(tmp_path / "x.yaml")],
    }
    done = without((*NOT_THE_MONITORS, *LIGHT), program, *words[program])
    assert done.returncode == 2
    assert "not installed" not in done.stderr
    assert str(tmp_path) in done.stderr or "nonsense" in done.stderr


def test_the_daemon_loads_none_even_where_they_are_installed():
    loaded = f"{{m.split('.')[0] for m, found in sys.modules.items() if found}} & {set(NOT_THE_MONITORS + LIGHT)}"
    run = "CliRunner().invoke(daemon, ['--config', 'config/daemon.yaml', '--bus', 'virtual'])"
    program = (
        f"import sys; from click.testing import CliRunner; from ema_daemon.command import daemon; {run}; "
        f"import can, ema_daemon.service; print(sorted({loaded}))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.strip() == "[]"
