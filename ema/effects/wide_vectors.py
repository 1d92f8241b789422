"""Vector width of everything compiled here; imported before the first function is jitted.

LLVM prefers half-width vectors on processors with AVX-512, since those with its first generation lower their clock for
full width. For the lanes of the HF model full width is a quarter faster: 7.9 instead of 10.5 ns per step and run
(Sapphire Rapids, `python -m benchmarks kernel`).
"""

from __future__ import annotations

import llvmlite.binding as llvm
import numba

_features = llvm.get_host_cpu_features()
if numba.config.CPU_FEATURES is None and _features.get("avx512f"):  # type: ignore[attr-defined]
    numba.config.CPU_FEATURES = f"{_features.flatten()},-prefer-256-bit"  # type: ignore[attr-defined]
