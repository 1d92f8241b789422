from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def hidden() -> ModuleType:
    """The independent actuator with flaws to hide (tests/support/hidden_actuator.py)."""
    path = Path(__file__).parents[1] / "support" / "hidden_actuator.py"
    spec = importlib.util.spec_from_file_location("hidden_actuator", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["hidden_actuator"] = module
    spec.loader.exec_module(module)
    return module
