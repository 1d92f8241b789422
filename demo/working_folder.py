"""What `ema init` puts into a working folder: shipped configuration files for each role, and what to do next."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ema.core import resources
from ema.core.errors import ConfigError
from ema.core.folders import make_folder


@dataclass(frozen=True)
class Role:
    """Who the folder is for.

    Attributes
    ----------
    files : tuple of str
        Names of shipped configuration files.
    folders : tuple of str
        Empty folders, as the configuration names them.
    steps : tuple of (what for, command)
        What to do next; each command works in the folder as it stands.
    then : str
        Where to read on.
    """

    files: tuple[str, ...]
    folders: tuple[str, ...]
    steps: tuple[tuple[str, str], ...]
    then: str


_BUILD = ("the offline phase, a minute or two", "ema build --config builder-quick.yaml --out bundle")
ROLES = {
    "tester": Role(
        ("actuator.yaml", "builder-quick.yaml", "daemon.yaml", "scenario.yaml"),
        ("log",),
        (
            _BUILD,
            ("the monitor, until Ctrl-C", "ema daemon --config daemon.yaml"),
            ("in a second terminal: an actuator with growing faults", "ema simulate --scenario scenario.yaml"),
        ),
        "`ema watch` in a third terminal shows the bus; docs/tutorials/tester.md goes on.",
    ),
    "integrator": Role(
        ("actuator.yaml", "builder-quick.yaml", "builder.yaml", "daemon.yaml", "alarms.yaml"),
        ("log",),
        (
            _BUILD,
            ("what this machine lacks for the monitor", "ema doctor --config daemon.yaml"),
            ("the monitor, until Ctrl-C", "ema daemon --config daemon.yaml"),
        ),
        "docs/tutorials/integrator.md and docs/service.md make a service of it.",
    ),
    "analyst": Role(
        ("actuator.yaml", "builder-quick.yaml", "alarms.yaml"),
        (),
        (
            ("a flight to begin with: bundle, log, report", "ema demo --out flight"),
            ("a report with thresholds of your own", "ema report flight/log --out flight.html --alarms alarms.yaml"),
            ("the detector run again on the log", "ema replay flight/log --identify"),
        ),
        "docs/tutorials/analyst.md goes on: tables, records, what the simulation gets wrong.",
    ),
}


def fill(folder: Path, role: str) -> list[Path]:
    """Make a role's working folder; what was put there.

    Raises
    ------
    ConfigError
        The folder is not empty, or cannot be made or written.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ConfigError(f"{folder}: is not an empty folder; 'ema init' writes into a new or an empty one")
    make_folder(folder)
    chosen, made = ROLES[role], []
    texts = {name: _beside(resources.config(name).read_text(encoding="utf-8")) for name in chosen.files}
    try:
        for name in chosen.folders:
            (folder / name).mkdir()
        for name, text in (texts | {"README.md": _readme(role, chosen)}).items():
            (folder / name).write_text(text, encoding="utf-8")
            made.append(folder / name)
    except OSError as error:
        raise ConfigError(f"{folder}: cannot be written ({error.strerror})") from error
    return made


def _beside(text: str) -> str:
    """A shipped configuration names what lies beside its folder; in a working folder all lies beside the file."""
    return text.replace("../", "").replace("config/", "")


def _readme(role: str, chosen: Role) -> str:
    lines = [f"# Working folder of the {role}", "", "Next, in this folder:", ""]
    lines += [f"    {command:<60} # {why}" for why, command in chosen.steps]
    lines += ["", chosen.then, "", "| file | what it is |", "|---|---|"]
    for name in chosen.files:
        first = resources.config(name).read_text(encoding="utf-8").splitlines()[0]
        lines.append(f"| {name} | {_beside(first.lstrip('# ')).partition('. ')[0].rstrip('.')} |")
    return "\n".join([*lines, ""])
