"""What looks like a law of the balance and may be the form of its other laws."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ema.core.records import Array
from ema.discrepancy.form import looks_like, made_by_form

if TYPE_CHECKING:
    from .found import Balance, Term


def of_others(b: Balance, term: Term) -> float:
    """Mean square of what looks like `term` and may be the form of the balance's other laws. [N² m² or N²]"""
    own, left, out = _alone(b, term), max(b.left - b.noise, 0.0), 0.0
    for other in (other for other in b.terms if other is not term):
        if other.law.freer is not None:
            out += made_by_form(
                _share_by_polynomials(b, term, other.law.freer(b.model.rows.motion, b.model.acting)), other.power
            )
        else:
            out += made_by_form(looks_like(own, _alone(b, other)), other.power, left)
    return out


def _alone(b: Balance, term: Term) -> list[Array]:
    """What a law does in each block beside all that may be fitted in its place. [N m or N]"""
    part, rows = b.model.part(term.law), b.model.rows
    own = b.model.beside_others(part, b.model.design[:, part] @ b.corrected.coefficients[part])
    return [own[rows.block == k] for k in range(rows.n_blocks)]


def _share_by_polynomials(b: Balance, term: Term, freer: tuple[Array, ...]) -> float:
    """Share in power of what a law does that another without a name would make with twice its freedom."""
    made, acting = b.model.rows.motion, b.model.acting
    own = np.stack(term.law.columns(made, acting), axis=1) @ b.corrected.coefficients[b.model.part(term.law)]
    A = np.stack(freer, axis=1)
    rest = own - A @ np.linalg.lstsq(A, own, rcond=None)[0]
    return 1.0 - float(rest @ rest) / max(float(own @ own), 1e-300)
