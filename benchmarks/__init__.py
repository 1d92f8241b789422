"""Measurements; the modules of tests/support, which hide what is to be found, are importable by their names."""

import os
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as in the command: threads would spin, and be counted

sys.path.append(str(Path(__file__).parents[1] / "tests" / "support"))
