"""docs/requirements.md: every promise has tests, and every test it names is there; likewise the table of attacks."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest
from adversary_table import attacks, told

ROOT = Path(__file__).resolve().parents[2]
ROW = re.compile(r"^\| ([A-Z]\d+) \| (.+?) \| (.+?) \|$", re.MULTILINE)
TEST = re.compile(r"`(tests/[\w/]+\.py)::(\w+)`")


def functions(path):
    """Names of the tests in a file."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")}


def faults(page):
    """What is wrong with a page of requirements."""
    rows = ROW.findall(page)
    found = [] if rows else ["there is no requirement"]
    numbers = [number for number, _, _ in rows]
    found += [f"{number} is given twice" for number in sorted({n for n in numbers if numbers.count(n) > 1})]
    lines = re.findall(r"^\| [A-Z]\d.*", page, re.MULTILINE)
    found += [f"{line[2:5]} is no row" for line in lines if not ROW.match(line)]
    for number, _, shown in rows:
        tests = TEST.findall(shown)
        if not tests or len(tests) != shown.count("`") // 2:
            found.append(f"{number} is shown by no test, or by what is none: {shown}")
        for file, name in tests:
            path = ROOT / file
            if not path.is_file() or name not in functions(path):
                found.append(f"{number}: there is no {file}::{name}")
    return found


def test_every_requirement_is_shown_by_tests_that_are_there():
    assert faults((ROOT / "docs/requirements.md").read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("| X1 | promises | |", "X1"),
        ("| X1 | promises | by hand |", "X1 is shown by no test"),
        ("| X1 | promises | `tests/core/test_units.py::test_that_is_not_there` |", "there is no tests/core"),
        ("| X1 | promises | `tests/nowhere.py::test_it` |", "there is no tests/nowhere.py"),
        ("no table", "there is no requirement"),
    ],
)
def test_the_check_finds(row, said):
    assert any(said in fault for fault in faults(row))


def test_the_table_of_attacks_is_that_of_the_suite():
    """Each attack has its row in docs/reliability.md, and each row its attack: `make test-adversary` writes it."""
    assert set(told((ROOT / "docs/reliability.md").read_text(encoding="utf-8"))) == attacks(ROOT / "tests/adversary")
