"""Each line of docs/security.md names tests that exist."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")
ROWS = [line for line in PAGE.splitlines() if line.startswith("|") and not re.match(r"\|(-|\s*attack )", line)]


def defined(file):
    """Names of a file's tests, methods as Class::name."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            yield node.name
        elif isinstance(node, ast.ClassDef):
            yield from (f"{node.name}::{part.name}" for part in node.body if isinstance(part, ast.FunctionDef))


def test_the_page_has_lines():
    assert len(ROWS) > 25


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.split("|")[1].strip()[:40])
def test_a_line_has_its_tests(row):
    named = re.findall(r"`(tests/[\w/]+\.py)(?:::([\w:]+))?`", row.split("|")[3])
    assert named
    for path, name in named:
        assert (ROOT / path).is_file(), path
        assert not name or name in set(defined(ROOT / path)), f"{path}::{name}"
