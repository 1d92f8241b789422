"""Where compiled kernels are kept, and what happens where nothing can be kept."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

PROGRAM = "import ema.models.jit, numba, os; print(numba.config.CACHE_DIR, os.access(numba.config.CACHE_DIR, os.W_OK))"


def ask(home):
    environment = os.environ | {"XDG_CACHE_HOME": str(home)}
    return subprocess.run([sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=True)


def test_kernels_are_kept_in_the_user_s_cache(tmp_path):
    done = ask(tmp_path)
    assert done.stdout.startswith(f"{tmp_path}/ema/kernels-")
    assert done.stderr == ""


def test_without_a_writable_cache_one_line_says_so_and_kernels_are_compiled_in_a_folder_that_goes_again(tmp_path):
    (tmp_path / "a_file").write_text("")
    done = ask(tmp_path / "a_file")
    folder, writable = done.stdout.split()
    assert writable == "True"
    assert not Path(folder).exists()
    assert done.stderr.count("\n") == 1
    assert "cannot be written" in done.stderr
    assert "XDG_CACHE_HOME" in done.stderr
