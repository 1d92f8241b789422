"""docs/effects.md is that of the library."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from ema.effects import registry

TOOL = Path(__file__).resolve().parents[2] / "tools" / "effect_reference.py"


def test_the_page_is_that_of_the_library():
    """If not: python tools/effect_reference.py"""
    spec = importlib.util.spec_from_file_location("effect_reference", TOOL)
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    text = tool.PAGE.read_text(encoding="utf-8")
    assert text == tool.page()
    assert all(f"## {name}\n" in text for name in registry())
