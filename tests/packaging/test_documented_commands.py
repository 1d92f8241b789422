"""Every command that the documents give exists, with the options and the files it is given.

The tutorials' commands are executed (`test_tutorials`); these are read.
"""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import click
import pytest

from ema.cli import cli

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = sorted({ROOT / "README.md", *(ROOT / "docs").rglob("*.md")})
TARGETS = re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.M)


def _lines():
    """Lines of code that begin with a command of ours, indented or fenced, and the same between back-quotes."""
    for path in DOCUMENTS:
        text = path.read_text(encoding="utf-8")
        found = re.findall(r"^(?: {4}|)((?:ema|make) [a-z].*)$", text, re.M) + re.findall(
            r"`((?:ema|make) [^`\n]+)`", text
        )
        for line in found:
            yield pytest.param(line.partition("  #")[0].strip(), id=f"{path.name}: {line[:60]}")


def _words(line):
    for one in re.split(r"\s(?:\|\||&&|[;|>&]|2>)(?:\s|$)", line):
        try:
            yield shlex.split(one)
        except ValueError:
            yield one.split()


@pytest.mark.parametrize("line", list(_lines()))
def test_the_command_is_there(line):
    for words in _words(line):
        if words[:1] == ["make"]:
            targets = [word for word in words[1:] if re.fullmatch(r"[a-z-]+", word)]
            assert set(targets) <= set(TARGETS), line
        elif words[:1] == ["ema"] and len(words) > 1:
            _check(words[1:], line)


def _check(words, line):
    command: click.Command | None = cli
    for name in list(words):
        if not isinstance(command, click.Group) or not re.fullmatch(r"[a-z][a-z-]*", name):
            break
        command = command.get_command(click.Context(command), name)
        assert command is not None, f"no such command: {line}"
        words = words[1:]
    options = {name for parameter in command.params for name in (*parameter.opts, *parameter.secondary_opts)}
    for word in words:
        name = word.strip("[]…,.").partition("=")[0]
        if re.fullmatch(r"--[a-z][a-z-]*", name) and name != "--help":
            assert name in options, f"no option {name}: {line}"
        if re.match(r"(config|tests|tools)/[\w./-]+$", name):
            assert (ROOT / name).exists(), f"no such file {name}: {line}"
