from __future__ import annotations

import os
from types import ModuleType

import pytest


@pytest.fixture(scope="session", autouse=True)
def _gives_way():
    """`make test`: a search waits for no clock, and leaves the processor to the worker beside it that does."""
    if "PYTEST_XDIST_WORKER" in os.environ:
        os.nice(10)


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
