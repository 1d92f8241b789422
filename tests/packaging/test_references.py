"""Pages of docs that are written from the code are those of this code."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from ema.effects import registry

TOOLS = Path(__file__).resolve().parents[2] / "tools"


@pytest.fixture(params=["effect_reference", "frame_reference", "model_reference"])
def tool(request):
    spec = importlib.util.spec_from_file_location(request.param, TOOLS / f"{request.param}.py")
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    return tool


def test_the_page_is_that_of_the_code(tool):
    """If not: python tools/effect_reference.py, or frame_ or model_reference.py"""
    assert tool.PAGE.read_text(encoding="utf-8") == tool.page()


def test_every_effect_has_its_place_on_the_page():
    text = (TOOLS.parent / "docs" / "effects.md").read_text(encoding="utf-8")
    assert all(f"## {name}\n" in text for name in registry())
