"""Where compiled kernels are kept: a folder per version of the equations.

Numba invalidates its cache only when the file of the compiled function itself changes, not when a function it
calls does; an edited effect would silently not count. So the folder's name is a hash over all equation files.
Import this module before anything that is jitted with ``cache=True``.
"""

from __future__ import annotations

import atexit
import hashlib
import logging
import os
import shutil
import tempfile
from pathlib import Path

import numba
import platformdirs


def equations_digest() -> str:
    """SHA-256 over the sources of ema.effects and ema.models, first 16 digits."""
    package = Path(__file__).resolve().parents[1]
    digest = hashlib.sha256()
    for path in sorted((*package.glob("effects/*.py"), *package.glob("models/*.py"))):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """The user's cache folder, or, where nothing can be written there, one that lives as long as this process."""
    folder = Path(platformdirs.user_cache_dir("ema")) / f"kernels-{equations_digest()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        logging.getLogger("ema").warning(
            "%s cannot be written (%s): kernels are compiled again by each process, some seconds; "
            "XDG_CACHE_HOME names another folder",
            folder,
            error.strerror,
        )
    own = Path(tempfile.mkdtemp(prefix="ema-kernels-"))
    atexit.register(_remove, own, os.getpid())
    return own


def _remove(folder: Path, owner: int) -> None:
    """At the end of the process that made it, not of those forked from it."""
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)


numba.config.CACHE_DIR = str(cache_folder())  # type: ignore[attr-defined]

# What the compiler may do to floating-point arithmetic. Not `reassoc`: dt/J, known early, would become a division at
# the end of the path that each step waits for.
FAST = {"contract", "nnan", "ninf", "nsz", "arcp"}
