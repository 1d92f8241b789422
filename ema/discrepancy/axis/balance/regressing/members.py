"""Members of a law's family: fitted between those that are tried, and how often each leaves least."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ema.core.records import Array
from ema.discrepancy.axis.balance.laws.law import Acting, Among, Law

from .regression import LEAST, Regression
from .rows import Rows

APART = 0.02  # of a step from member to member: two laws whose difference is the slope
N_STEPS = 12  # of Gauss and Newton's at most
SHORTER = 0.5 ** np.arange(6.0)  # shares of a step that are tried at once
LITTLE = 1e-6  # share of what a law takes, below which a step is the last
N_FINER = 9  # times that the step between members of a family is halved
N_SHAPES = 6  # the same of a second size: less is seen of it


def gains_of(found: Rows, model: Regression, members: Sequence[Law]) -> Array:
    """What each member would take of the square that is left, shape (n_members,)."""
    q, _ = np.linalg.qr(model.design)
    left = model.left - q @ (q.T @ model.left)
    A = np.stack([found.of(law, model.acting) for law in members])  # (n_members, n_columns, n_rows)
    A -= (A @ q) @ q.T
    gram, b = A @ A.transpose(0, 2, 1), A @ left
    return np.asarray(np.einsum("mc,mcd,md->m", b, np.linalg.pinv(gram, rcond=1e-6, hermitian=True), b))


def fit_sizes(found: Rows, model: Regression, members: Sequence[Law]) -> Law:
    """The member of a family that takes most of what a model without it leaves, by Gauss and Newton's steps.

    Where a family has a second size what is left may have several lowest points along it: one is sought from each
    member's.
    """
    starts: dict[tuple[float, ...], Law] = {}
    for k in np.argsort(gains_of(found, model, members), kind="stable"):
        starts[tuple(_among(members[k]).at[1:])] = members[k]  # the best is the last
    fitted = [_descend(found, model, law) for law in starts.values()]
    return fitted[int(np.argmax(gains_of(found, model, fitted)))]


def members_around(found: Rows, model: Regression, law: Law, members: Sequence[Law]) -> list[Law]:
    """Members from near to far: of each value of a second size those about the first size that is best beside it."""
    at, ends = _among(law).at, _among(law).ends
    finer = np.concatenate([[0.0], 0.5 ** np.arange(N_FINER + 1.0), -(0.5 ** np.arange(N_FINER + 1.0))])
    seconds = [at[1:]]
    if len(at) > 1:
        near = at[1] + np.concatenate([0.5 ** np.arange(N_SHAPES + 1.0), -(0.5 ** np.arange(N_SHAPES + 1.0))])
        tried = {*np.clip(near, *ends[1]), *(float(_among(own).at[1]) for own in members)}
        seconds += [np.array([x]) for x in sorted(tried, key=lambda x: abs(x - at[1]))]
    out = {}
    for second in seconds:
        best = _descend(found, model, _among(law).member(np.concatenate([at[:1], second])), n_free=1)
        for step in finer:
            own = _among(best).moved(np.concatenate([[step], np.zeros(len(second))]))
            out[own.key] = own
    return list(out.values())


def draw_members(found: Rows, model: Regression, members: Sequence[Law], n_draws: int) -> NDArray[np.intp]:
    """Which member leaves least of blocks that are drawn with replacement, all refitted to them, shape (n_draws,)."""
    n, A, y = found.n_blocks, model.design, found.y
    size = np.maximum(np.linalg.norm(A, axis=0), 1e-300)
    A = A / size
    lots = np.random.default_rng(1).multinomial(n, np.full(n, 1.0 / n), n_draws).astype(float)
    of = [found.block == b for b in range(n)]

    def drawn(a: Array, b: Array) -> Array:
        """AᵀB of each draw, shape (n_draws, n_a, n_b)."""
        return np.asarray(np.tensordot(lots, np.stack([a[own].T @ b[own] for own in of]), 1))

    inverse = np.linalg.pinv(drawn(A, A), rcond=LEAST, hermitian=True)
    right = inverse @ drawn(A, y[:, None])
    gains = []
    for law in members:
        F = found.of(law, model.acting).T
        F = F / max(float(np.linalg.norm(F)), 1e-300)
        g = drawn(A, F)
        S = drawn(F, F) - g.transpose(0, 2, 1) @ inverse @ g
        b = drawn(F, y[:, None]) - g.transpose(0, 2, 1) @ right
        gains.append(np.sum(b * (np.linalg.pinv(S, rcond=LEAST, hermitian=True) @ b), axis=(1, 2)))
    return np.asarray(np.argmax(np.stack(gains), axis=0))


def _descend(found: Rows, model: Regression, law: Law, n_free: int | None = None) -> Law:
    """By Gauss and Newton's steps, of all sizes or the first `n_free`."""
    for _ in range(N_STEPS):
        among = _among(law)
        (f,) = found.of(law, model.acting)
        A = np.column_stack([model.design, f, _slopes(found, among, model.acting)[:, :n_free]])
        size = np.maximum(np.linalg.norm(A, axis=0), 1e-300)
        solved = np.linalg.lstsq(A / size, found.y, rcond=LEAST)[0] / size
        c, moves = solved[model.design.shape[1]], np.zeros(len(among.at))
        moves[:n_free] = solved[model.design.shape[1] + 1 :]
        if c == 0.0:
            break
        tried = [among.moved(share * moves / c) for share in SHORTER]
        taken, *gains = gains_of(found, model, [law, *tried])
        best = int(np.argmax(gains))
        if gains[best] <= (1.0 + LITTLE) * taken:
            break
        law = tried[best]
    return law


def _among(law: Law) -> Among:
    assert law.among is not None
    return law.among


def _slopes(found: Rows, among: Among, acting: Acting) -> Array:
    """Change of a law's column with each of its sizes, shape (n_rows, n_sizes)."""
    out = []
    for own in np.eye(len(among.at)):
        low, high = np.clip(among.at - APART * own, *among.ends.T), np.clip(among.at + APART * own, *among.ends.T)
        (below,), (above,) = found.of(among.member(low), acting), found.of(among.member(high), acting)
        out.append((above - below) / float(own @ (high - low)))
    return np.column_stack(out)
