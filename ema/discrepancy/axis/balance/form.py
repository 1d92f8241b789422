"""What looks like a law and may be the form of another one, since no law of the library has quite the right form."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ema.core.records import Array

if TYPE_CHECKING:
    from .found import Balance, Term

LEAST = 1e-9  # of what is left by a law that stands for all of another's form: it may leave nothing


def made_by_form(b: Balance, term: Term, inexact: float) -> float:
    """Mean square of what looks like `term` and may be the form of the balance's other laws. [N² m² or N²]

    Laws are `inexact` by that much of what they do. Of each as much as looks like the law, and no more than what is
    left allows: were it a stand-in for a share s of another's form, the share 1 - s would be left.
    """
    own, left, out = _beside_others(b, term), max(b.left - b.noise, 0.0), 0.0
    for other in b.terms:
        if other is not term:
            s = _share_by_polynomials(b, term, other) if other.law.freer else _share_by_block(b, own, other)
            allowed = np.inf if other.law.freer else left / max(1.0 - s, LEAST)
            out += s * min(inexact**2 * other.power, allowed)
    return out


def _share_by_block(b: Balance, own: Array, other: Term) -> float:
    """Share in power of what a law does that another would make, were it of another strength in each block."""
    its, block, n = _beside_others(b, other), b.model.rows.block, b.model.rows.n_blocks
    both, size = np.bincount(block, own * its, n), np.bincount(block, its**2, n)
    return float(np.sum(both[size > 0.0] ** 2 / size[size > 0.0]) / max(float(own @ own), 1e-300))


def _share_by_polynomials(b: Balance, term: Term, other: Term) -> float:
    """The same of another that has no name, by twice its freedom."""
    made, acting = b.model.rows.motion, b.model.acting
    own = np.stack(term.law.columns(made, acting), axis=1) @ b.corrected.coefficients[b.model.part(term.law)]
    assert other.law.freer is not None
    freer = np.stack(other.law.freer(made, acting), axis=1)
    rest = own - freer @ np.linalg.lstsq(freer, own, rcond=None)[0]
    return 1.0 - float(rest @ rest) / max(float(own @ own), 1e-300)


def _beside_others(b: Balance, term: Term) -> Array:
    """What a law does beside all that may be fitted in its place, shape (n_rows,). [N m or N]"""
    part, A = b.model.part(term.law), b.model.design
    Q, _ = np.linalg.qr(np.delete(A, part, axis=1))
    own = A[:, part] @ b.corrected.coefficients[part]
    return np.asarray(own - Q @ (Q.T @ own))
