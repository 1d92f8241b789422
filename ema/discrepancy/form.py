"""How far a law may be a stand-in for the form of another one, since no law of the library has quite the right form."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ema.core.records import Array

FORM = 0.17  # what the laws of the library are off by, relative: a Lorentzian for an exponential Stribeck curve, say
LEAST = 1e-9  # of what is left by a law that stands for all of another's form: it may leave nothing


def looks_like(one: Sequence[Array], other: Sequence[Array]) -> float:
    """Share in power of what one law does that another would make, were it of another strength in each block."""
    both = sum(float(a @ b) ** 2 / float(b @ b) for a, b in zip(one, other, strict=True) if b.any())
    return both / max(sum(float(a @ a) for a in one), 1e-300)


def made_by_form(share: float, mark: float, left: float = np.inf) -> float:
    """Mean square of what looks like a law and may be the form of another: it is a `share` of that, which has `mark`.

    No more than what is left allows: were the law a stand-in for that share, the rest of the form would be left.
    """
    return share * min(FORM**2 * mark, left / max(1.0 - share, LEAST))
