"""Do the records of one bench agree on a coefficient? Own values by record, with a test that they are one.

χ² is the distance of the records' values from their common one, by the covariance that blocks show; its p is that of
F, since the covariance rests on few blocks. Noise is not all that moves a coefficient: the law has never quite the
right form. Records contradict each other where they do so beyond that, too.

References
----------
Cochran, "The combination of estimates from different experiments", Biometrics 10, 1954.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from ema.core.records import Array
from ema.discrepancy.axis.balance.laws.law import BY_RECORD, BY_RECORD_NAME, Law

from .apart import DIFFERS, by_record
from .regression import Plain, Regression, regress
from .rows import Rows

INEXACT = 0.1  # of a coefficient, that another motion may move it by, since no law has quite the right form
RARE = 0.01  # p below which records do not agree, over all that is asked
USUAL = 0.05  # p from which nothing speaks against one value, whatever else each record foretells better
SHOWN = 0.01  # p below which one record shows a law
UNSEEN = 1e3  # of a coefficient, by which it may be off in a record in which nothing shows it


@dataclass(frozen=True)
class Agreement:
    """One law, or one of inertia, friction and drag, record by record.

    Attributes
    ----------
    name : str
    law : Law or None
        None for inertia, dry friction and drag.
    values : array, shape (n_records, n_columns)
        Coefficients.
    covariance : array, shape (n_records, n_columns, n_columns)
        Of each record's own.
    chi2, dof, p : float
        Of the hypothesis that all are one.
    p_inexact : float
        The same where the law may be a tenth off in each.
    odds : float
        Likelihood of one value with that tolerance over that of values as different as they are large; at most 1.
    needed : bool
        Whether the records foretell held-out blocks better by values of their own.
    shown, could : tuple of bool
        Whether a record shows the law by itself, and whether one of the common size would stand out there.
    """

    name: str
    law: Law | None
    values: Array
    covariance: Array
    chi2: float
    dof: int
    p: float
    p_inexact: float
    odds: float
    needed: bool
    shown: tuple[bool, ...]
    could: tuple[bool, ...]

    @property
    def why(self) -> str:
        """What lets it be another in each record without contradicting it; empty if nothing does."""
        return DIFFERS.get(self.name, "")

    def is_one(self, n_asked: int) -> bool:
        """Whether the records agree, where so many questions are asked."""
        return self.p >= USUAL or (not self.needed and self.p_inexact >= RARE / max(n_asked, 1))


def agreements(found: Rows, plain: Plain, model: Regression) -> list[Agreement]:
    """Every coefficient of the model, record by record; none where there is one record."""
    records = found.motion.records
    if len(records) < 2:
        return []
    blocks = [len(np.unique(found.block[found.record == k])) for k in range(len(records))]
    if min(blocks) < 3:
        return []
    out = [_of_law(found, plain, model, law, min(blocks)) for law in model.laws if not _is_of_base(law)]
    return [*_of_base(found, plain, model, min(blocks)), *out]


def _is_of_base(law: Law) -> bool:
    return law.key.removesuffix(BY_RECORD) in ("inertia", "dry_friction", "viscous_drag")


def _of_law(found: Rows, plain: Plain, model: Regression, law: Law, n_blocks: int) -> Agreement:
    own = law if law.key.endswith(BY_RECORD) else by_record(law, len(found.motion.records))
    fit = regress(found, plain, [own if other.key == law.key else other for other in model.laws])
    part = fit.part(own)
    n = own.n_columns // len(found.motion.records)
    covariance = fit.covariance()[part, part]
    name = law.name.removesuffix(BY_RECORD_NAME)
    return _compare(name, own, fit.coefficients[part].reshape(-1, n), covariance, n_blocks, needed=own is law)


def _of_base(found: Rows, plain: Plain, model: Regression, n_blocks: int) -> list[Agreement]:
    """Inertia, friction and drag as each record alone has them beside the laws that all share."""
    n, shared = len(found.motion.records), [law for law in model.laws if not _is_of_base(law)]
    fit = regress(found, plain, shared, apart=True)
    covariance, out, keys = fit.covariance(), [], {law.key for law in model.laws}
    nominal = {"inertia": 0.0, "dry_friction": plain.F_d, "viscous_drag": plain.C}
    for k, name in enumerate(own.split(BY_RECORD)[0] for own in fit.base[::n]):
        part = slice(k * n, (k + 1) * n)
        values = fit.coefficients[part, None] + nominal[name]
        needed = name + BY_RECORD in keys
        out.append(_compare(name, None, values, covariance[part, part], n_blocks, needed=needed))
    return out


def _compare(name: str, law: Law | None, values: Array, covariance: Array, n_blocks: int, *, needed: bool) -> Agreement:
    """`covariance`: of all values in a row, shape (n_records n_columns,) twice."""
    n_records, n = values.shape
    c, unseen = values.ravel(), np.diag(covariance) == 0.0
    seen = ~unseen.reshape(n_records, n).any(axis=1)
    size = float(np.mean(np.sum(values[seen] ** 2, axis=1))) if seen.any() else 0.0
    covariance = covariance + np.diag(unseen * UNSEEN**2 * size)
    contrast = np.kron(np.eye(n_records)[:-1] - np.eye(n_records)[-1:], np.eye(n))
    d, V, one = contrast @ c, contrast @ covariance @ contrast.T, contrast @ contrast.T
    inexact = V + one * INEXACT**2 * size / n
    chi2, beyond = _square(d, V), _square(d, inexact)
    dof, free = len(d), n_blocks - 1
    odds = _log_likelihood(d, inexact) - _log_likelihood(d, inexact + one * size / n)
    own = np.stack([covariance[k * n : (k + 1) * n, k * n : (k + 1) * n] for k in range(n_records)])
    limit = n * float(stats.f.isf(SHOWN, n, free))
    common = np.full(n, np.sqrt(size / n))
    shown = tuple(_square(v, V_k) > limit for v, V_k in zip(values, own, strict=True))
    could = tuple(_square(common, V_k) > limit for V_k in own)
    p, p_inexact = (float(stats.f.sf(x / dof, dof, free)) for x in (chi2, beyond))
    odds = float(np.exp(min(odds, 0.0)))
    return Agreement(name, law, values, own, chi2, dof, p, p_inexact, odds, needed, shown, could)


def _square(d: Array, V: Array) -> float:
    return float(d @ np.linalg.pinv(V, rcond=1e-12, hermitian=True) @ d)


def _log_likelihood(d: Array, V: Array) -> float:
    return -0.5 * (_square(d, V) + float(np.linalg.slogdet(V)[1]))
