"""Into a pipe every line is whole, however narrow the terminal that is not there would be."""

from __future__ import annotations

import subprocess
import sys

LINE = "word " * 60


def test_a_line_into_a_pipe_is_not_broken():
    code = "from ema.core.terminal import console\n"
    code += f"for error in (False, True): console(stderr=error).print({LINE.strip()!r})"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.splitlines() == ran.stderr.splitlines() == [LINE.strip()]
