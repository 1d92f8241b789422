from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest


def _support(name: str) -> ModuleType:
    path = Path(__file__).parents[1] / "support" / f"{name}.py"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def axis_bench() -> ModuleType:
    """The independent motor bench (tests/support/axis_bench.py)."""
    return _support("axis_bench")


@pytest.fixture(scope="session")
def hidden_axis(axis_bench: ModuleType) -> ModuleType:
    """What can be hidden in that bench (tests/support/hidden_axis.py)."""
    return _support("hidden_axis")


@pytest.fixture(scope="session")
def axis_other() -> ModuleType:
    """Further axes of other code still (tests/support/axis_other.py)."""
    return _support("axis_other")
