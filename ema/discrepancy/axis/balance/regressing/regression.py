"""Least squares of the balance with held-out blocks, and intervals on which blocks agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ema.core.records import Array
from ema.discrepancy import blocks_left_out
from ema.discrepancy.axis.balance.laws.law import BY_RECORD, Acting, Law
from ema.effects.position_friction import EFFECT as STRETCH

from .rows import Rows

LEAST = 1e-8  # of the largest eigenvalue, below which no row, or the block that is left out alone, tells a direction
N_ROUNDS = 6  # of laws that depend on what else acts, which depends on them
BELOW = 2.0  # deviations from zero, from which the sign of an inertia, a friction or a drag is sure
N_FOLDS = 4  # interleaved: each holds out every fourth block


@dataclass(frozen=True)
class Plain:
    """What the plant file says of inertia, dry friction and drag, and of the torque per current."""

    inertia: float
    F_d: float
    C: float
    k_t: float = 1.0


@dataclass(frozen=True)
class Corrected:
    """Coefficients, shape (n,), and their covariance, shape (n, n)."""

    coefficients: Array
    covariance: Array


@dataclass(frozen=True)
class Regression:
    """A fitted balance.

    Attributes
    ----------
    laws : tuple of Law
    base : tuple of str
        Those of inertia, dry friction and drag that the motions can show.
    design : array, shape (n_rows, n_coefficients)
        Columns of the base, then of the laws.
    coefficients : array, shape (n_coefficients,)
        Of dry friction and drag: less the plant file's.
    left : array, shape (n_rows,)
        Residual. [N m or N]
    held_out : array, shape (n_rows,)
        Residual of rows whose block was not fitted; nan for rows that lie in two blocks.
    taken : Acting
        What laws that depend on what else acts were fitted with.
    """

    rows: Rows
    plain: Plain
    laws: tuple[Law, ...]
    base: tuple[str, ...]
    design: Array
    coefficients: Array
    left: Array
    held_out: Array
    taken: Acting

    @cached_property
    def acting(self) -> Acting:
        """What this model needs of the drive; most models are tried and left, and nobody asks."""
        own = [law.columns(self.rows.motion, self.taken) for law in self.laws]
        return _split_drive(self.rows, self.plain, self.base, self.laws, own, self.coefficients)

    @property
    def losses(self) -> Array:
        """Square of the held-out residual, summed over each block, shape (n_blocks,)."""
        return np.asarray(
            np.bincount(self.rows.block, np.nan_to_num(self.held_out) ** 2, self.rows.n_blocks), np.float64
        )

    @property
    def loss(self) -> float:
        """The same over all blocks."""
        return float(self.losses.sum())

    def part(self, law: Law) -> slice:
        """Which coefficients are those of a law."""
        at = len(self.base)
        for own in self.laws:
            n = own.n_columns
            if own.key == law.key:
                return slice(at, at + n)
            at += n
        raise KeyError(law.key)

    def beside_others(self, part: slice, x: Array) -> Array:
        """`x`, shape (n_rows, ...), less what all coefficients but those of a part can do of it."""
        q, _ = np.linalg.qr(np.delete(self.design, part, axis=1))
        return np.asarray(x - q @ (q.T @ x))

    def shared(self, law: Law, other: Regression) -> float:
        """Share of what the last law of `other` does, beside all that both have, that `law` can do as well."""
        mine, its = self.part(law), other.design[:, other.part(other.laws[-1])]
        both = self.beside_others(mine, np.column_stack([self.design[:, mine], its]))
        own, its = both[:, : law.n_columns], both[:, law.n_columns :]
        basis, _ = np.linalg.qr(own)
        return float(np.sum((basis.T @ its) ** 2) / max(float(np.sum(its**2)), 1e-300))

    def covariance(self) -> Array:
        """Of the coefficients, by leaving out one block after the other: rows overlap, and no law is quite right.

        A coefficient that no row shows, as the inertia at a standstill, has none: its rows and columns are 0. Of
        coefficients that only together show, as friction and a constant torque in motion one way, what each is may be
        as large as the drive.
        """
        size = np.linalg.norm(self.design, axis=0)
        seen = size > 0.0
        A, n = self.design[:, seen] / size[seen], self.rows.n_blocks
        parts = [(A[own], self.left[own]) for own in (self.rows.block == b for b in range(n))]
        gram = A.T @ A
        moved = blocks_left_out.covariance(gram, ((P.T @ P, P.T @ r) for P, r in parts), LEAST)
        told, directions = np.linalg.eigh(gram)
        untold = directions[:, told < LEAST * told[-1]]
        moved += float(self.rows.y @ self.rows.y) * untold @ untold.T
        out = np.zeros((len(size), len(size)))
        out[np.ix_(seen, seen)] = moved / np.outer(size[seen], size[seen])
        return out


def is_machine(model: Regression, other: Regression, plain: Plain) -> bool:
    """Whether `other`, which has a law more than `model`, has no inertia turned round and no friction that drives."""
    return not (_turns_inertia(model, other) or _drives_by_friction(other, plain))


def _drives_by_friction(model: Regression, plain: Plain) -> bool:
    """Whether a stretch of other friction, the last law, has clearly less than none: it helps whichever way it goes."""
    law = model.laws[-1]
    if law.name != STRETCH.name or "dry_friction" not in model.base:
        return False
    both = [model.base.index("dry_friction"), model.part(law).start]
    friction = plain.F_d + float(model.coefficients[both].sum())
    return bool(friction < -BELOW * model.covariance()[np.ix_(both, both)].sum() ** 0.5)


def _turns_inertia(model: Regression, other: Regression) -> bool:
    """Whether the inertia, clearly above zero in `model`, is below it in `other`.

    Friction by a share of what drives can take the place of all that the drive is needed for, with the other sign.
    """
    if "inertia" not in model.base or "inertia" not in other.base:
        return False
    at, there = model.base.index("inertia"), other.base.index("inertia")
    value, turned = model.coefficients[at], other.coefficients[there]
    if not turned < 0.0 < value:
        return False
    return bool(value > BELOW * model.covariance()[at, at] ** 0.5)


def regress(rows: Rows, plain: Plain, laws: Sequence[Law], *, apart: bool = False) -> Regression:
    """Fit the base and `laws`; the base `apart`: one column for each record."""
    base, columns = tuple(rows.base), np.column_stack(list(rows.base.values()))
    if apart:
        records = rows.motion.records
        base = tuple(f"{name}{BY_RECORD} {k}" for name in base for k in range(len(records)))
        of = (np.arange(len(records)) == rows.record[:, None]).astype(float)  # (n_rows, n_records)
        columns = (columns[:, :, None] * of[:, None, :]).reshape(len(rows.y), -1)
    m = rows.motion
    acting = Acting(m.drive, m.drive, m.drive)

    def design(acting: Acting) -> Array:
        return np.column_stack([columns, *(column for law in laws for column in rows.of(law, acting))])

    if any(law.needs_acting for law in laws):
        acting = regress(rows, plain, [law for law in laws if not law.needs_acting]).acting
        fixed = {law.key: law.columns(m, acting) for law in laws if not law.needs_acting}
        for _ in range(N_ROUNDS - 1):
            own = [fixed.get(law.key) or law.columns(m, acting) for law in laws]
            acting = _split_drive(rows, plain, base, laws, own, _solve(design(acting), rows.y))
    A = design(acting)
    coefficients = _solve(A, rows.y)
    left = rows.y - A @ coefficients
    return Regression(rows, plain, tuple(laws), base, A, coefficients, left, _held_out(rows, A), acting)


def _solve(design: Array, y: Array) -> Array:
    size = np.linalg.norm(design, axis=0)
    size = np.where(size > 0.0, size, 1.0)  # of what no row shows the coefficient is 0, and no digit of it over nothing
    A = design / size
    return _of_normal(A.T @ A, A.T @ y) / size


def _of_normal(gram: Array, right: Array) -> Array:
    """The solution of one or of several systems, shapes (..., n, n) and (..., n)."""
    return np.asarray((np.linalg.pinv(gram, rcond=LEAST, hermitian=True) @ right[..., None])[..., 0])


def _held_out(rows: Rows, design: Array) -> Array:
    """Residual of each row by coefficients to which its fold did not belong."""
    size = np.maximum(np.linalg.norm(design, axis=0), 1e-300)
    A, fold = design / size, rows.block % N_FOLDS
    parts = [(A[fold == k].T @ A[fold == k], A[fold == k].T @ rows.y[fold == k]) for k in range(N_FOLDS)]
    gram, right = (np.sum(column, axis=0) for column in zip(*parts, strict=True))
    out = np.full(len(rows.y), np.nan)
    others = _of_normal(gram - np.stack([own for own, _ in parts]), right - np.stack([own for _, own in parts]))
    for k, coefficients in enumerate(others):
        test = (fold == k) & rows.whole
        out[test] = rows.y[test] - A[test] @ coefficients
    return out


def _split_drive(
    rows: Rows, plain: Plain, base: tuple[str, ...], laws: Sequence[Law], own: Sequence[tuple[Array, ...]], c: Array
) -> Acting:
    """The drive's torque that this model needs, and what of it is no friction. [N m or N]"""
    m = rows.motion
    beyond = m.drive - m.known  # what the plant file takes
    friction = plain.F_d * m.direction + plain.C * m.w

    def of(name: str) -> Array | float:
        """Coefficient of a base law along the samples."""
        own = dict(zip(base, c, strict=False))
        if name in own or not base or BY_RECORD not in base[0]:
            return float(own.get(name, 0.0))
        return np.array([own.get(f"{name}{BY_RECORD} {k}", 0.0) for k in range(len(m.records))])[m.record]

    dissipated = of("dry_friction") * m.direction + of("viscous_drag") * m.w
    load = of("inertia") * m.a
    at = len(base)
    for law, columns in zip(laws, own, strict=True):
        for column in columns:
            if law.is_friction:
                dissipated = dissipated + c[at] * column
            else:
                load = load + c[at] * column
            at += 1
    return Acting(beyond + load + dissipated, beyond - friction + load, beyond - friction + load - of("inertia") * m.a)
