from __future__ import annotations

from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def axis_bench(support) -> ModuleType:
    """The independent motor bench (tests/support/axis_bench.py)."""
    return support("axis_bench")


@pytest.fixture(scope="session")
def hidden_axis(axis_bench: ModuleType, support) -> ModuleType:
    """What can be hidden in that bench (tests/support/hidden_axis.py)."""
    return support("hidden_axis")


@pytest.fixture(scope="session")
def axis_other(support) -> ModuleType:
    """Further axes of other code still (tests/support/axis_other.py)."""
    return support("axis_other")
