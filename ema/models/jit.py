"""Where compiled kernels are kept: a folder per version of the equations.

Numba invalidates its cache only when the file of the compiled function itself changes, not when a function it
calls does; an edited effect would silently not count. So the folder's name is a hash over all equation files.
Import this module before anything that is jitted with ``cache=True``.
"""

from __future__ import annotations

import hashlib
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


numba.config.CACHE_DIR = str(Path(platformdirs.user_cache_dir("ema")) / f"kernels-{equations_digest()}")  # type: ignore[attr-defined]

# What the compiler may do to floating-point arithmetic. Not `reassoc`: dt/J, known early, would become a division at
# the end of the path that each step waits for.
FAST = {"contract", "nnan", "ninf", "nsz", "arcp"}
