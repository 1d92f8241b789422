from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))
import toys as _toys


@pytest.fixture(scope="session")
def toys():
    return _toys
