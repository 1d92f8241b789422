"""How the finder's modules rest on each other: numbers that may fall, and never rise (`python tools/imports.py`)."""

from __future__ import annotations

from pathlib import Path

import pytest

from tools.imports import circle, imports, longest_chain, untested

TESTS = Path(__file__).parent.parent
LONGEST_CHAIN = 8  # modules


@pytest.fixture(scope="module")
def finder():
    return imports("ema.discrepancy")


def test_no_circle(finder):
    assert circle(finder) == []


def test_chains_get_no_longer(finder):
    assert len(longest_chain(finder)) <= LONGEST_CHAIN


def test_no_module_is_without_a_test_that_imports_it(finder):
    assert untested(finder, TESTS.rglob("*.py")) == []


def test_a_circle_and_a_chain_are_seen():
    around = {"a": frozenset("b"), "b": frozenset("c"), "c": frozenset("a"), "d": frozenset()}
    assert set(circle(around)) == {"a", "b", "c"}
    straight = {"a": frozenset("bc"), "b": frozenset("c"), "c": frozenset(), "d": frozenset("c")}
    assert circle(straight) == []
    assert longest_chain(straight) == ["a", "b", "c"]


def test_a_module_without_a_test_is_seen(tmp_path):
    test = tmp_path / "test_one.py"
    test.write_text("from ema.discrepancy.engine import fit\nimport ema.discrepancy.folds\n")
    of = dict.fromkeys(f"ema.discrepancy.{m}" for m in ("engine.fit", "folds", "verdict"))
    assert untested(of, [test]) == ["ema.discrepancy.verdict"]
