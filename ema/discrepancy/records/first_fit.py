"""Inertia, drag and dry friction for a first plant file, with the torque that is locked to the angle beside them.

    τ = J dω/dt + C ω + F_d sgn ω + τ₀ + Σ c_n cos nθ + s_n sin nθ

by least squares, each term seen through the filter that takes the derivative: good enough to begin a search. Without
the lines, which are each record's own, a slow record with cogging reads as dry friction several times too high, and a
pendulum as inertia.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.linalg import block_diag

from ema.core.records import Array, Cycle, Record
from ema.discrepancy.axis.scanning.cogging import integer_orders, scan
from ema.discrepancy.axis.scanning.weak_form import Motion, Weak

from .agreements import OVER, derivative, smooth

SLOW = 0.02  # of the highest speed; below, friction's sign is not known
FEWEST = 50  # samples in motion
MOST = 2000  # of a record, evenly; the search over orders takes its time
BESIDE = 0.03  # of its size that a column must have beside the others: one speed does not tell drag from friction
CLEAR = 3.0  # deviations from which a value is shown
SWINGS = 0.3  # [rad] of travel that shows a pendulum apart from a straight line
SEEN = 0.5 * np.pi  # of a line's phase, from one sample to the next; beyond, it is sampled too seldom
BOX = np.full(OVER, 1.0 / OVER)
_K = np.arange(OVER) - OVER // 2
SLOPE = np.cumsum(-_K / float(_K @ _K))[:-1]  # what the slope over some samples sees of a derivative
SLOPE = np.convolve(SLOPE, (0.5, 0.5))


@dataclass(frozen=True)
class FirstFit:
    """Inertia, drag, dry friction; None where the records do not show one. `orders` of torque stood beside them."""

    inertia: float | None
    drag: float | None
    friction: float | None
    orders: tuple[float, ...] = ()


def first_fit(records: Sequence[Record], position: str, speed: str, drive: Sequence[Sequence[Array]]) -> FirstFit:
    """Fit of all records; `drive`: its torque or force at the samples, by record and cycle."""
    parts = [_weak(record, position, speed, taus) for record, taus in zip(records, drive, strict=True)]
    weak = [one for one in parts if one is not None]
    if not weak:
        return FirstFit(None, None, None)
    orders = [_orders(one) if position == "theta_m" else () for one in weak]
    own = block_diag(*(_own(one, n) for one, n in zip(weak, orders, strict=True)))
    base = {
        "inertia": np.concatenate([one.inertia for one in weak]),
        "friction": np.concatenate([one.integrate(one.motion.direction) for one in weak]),
        "drag": np.concatenate([one.integrate(one.motion.w) for one in weak]),
    }
    every = tuple(sorted({n for found in orders for n in found}))
    return _solve(base, own, np.concatenate([one.y for one in weak]), every)


def _weak(record: Record, position: str, speed: str, taus: Sequence[Array]) -> Weak | None:
    """Drive and motion of a record through the filter of the derivative; None where it hardly moves."""
    own = speed in record.channels and any(cycle[speed].any() for cycle in record.cycles)  # not at rest
    kernel = np.convolve(BOX if own else SLOPE, SLOPE)
    reach = len(kernel) // 2
    motions: list[tuple[Array, ...]] = []
    ys: list[Array] = []
    accelerations: list[Array] = []
    indices: list[NDArray[np.int_]] = []
    offset = 0
    for cycle, tau in zip(record.cycles, taus, strict=True):
        if cycle.n_samples <= 8 * OVER:
            continue
        w = smooth(cycle[speed]) if own else derivative(cycle, position)
        theta = _angle(cycle, position, w)
        centres = np.arange(2 * OVER, cycle.n_samples - 2 * OVER)
        index = centres[:, None] + np.arange(-reach, reach + 1)
        accelerations.append(derivative(cycle, w)[centres])
        ys.append(tau[index] @ kernel)
        indices.append(index + offset)
        raw = cycle[speed] if own else w
        motions.append((theta, raw, tau, cycle["t"], np.sign(w), np.zeros(len(w))))
        offset += cycle.n_samples
    if not motions:
        return None
    index = np.concatenate(indices)
    motion = Motion(*(np.concatenate(column) for column in zip(*motions, strict=True)))
    speeds = np.abs(motion.w[index[:, reach]])
    moving = np.flatnonzero(speeds > SLOW * speeds.max())
    if len(moving) < FEWEST:
        return None
    few = moving[np.unique(np.linspace(0, len(moving) - 1, MOST).astype(int))]
    n = len(few)
    y, a = (np.concatenate(x)[few] for x in (ys, accelerations))
    return Weak(y, np.ones(n), a, motion, index[few], np.tile(kernel, (n, 1)), np.zeros(n, int))


def _angle(cycle: Cycle, position: str, w: Array) -> Array:
    if position in cycle:
        return np.unwrap(cycle[position]) if position == "theta_m" else cycle[position]
    return np.asarray(cumulative_trapezoid(w, cycle["t"], initial=0.0))


def _orders(weak: Weak) -> tuple[float, ...]:
    """Orders per turn of a torque that stands out beside inertia, drag and friction."""
    orders = integer_orders(weak)
    if float(np.ptp(weak.motion.theta)) > SWINGS:
        orders = np.union1d([1.0], orders)
    m, at = weak.motion, weak.index[:, weak.index.shape[1] // 2]
    way = float(np.median(np.abs(m.w[at]))) * float(np.median(np.abs(np.diff(m.t))))
    orders = orders[orders * way < SEEN]
    return scan(weak, orders).orders if len(orders) else ()


def _own(weak: Weak, orders: tuple[float, ...]) -> Array:
    """Columns of what is a record's own: a constant and lines, shape (n_y, 1 + 2 n)."""
    theta = weak.motion.theta
    columns = [np.ones(len(theta)), *(f(n * theta) for n in orders for f in (np.cos, np.sin))]
    return weak.integrate(np.stack(columns, axis=1))


def _solve(base: dict[str, Array], own: Array, tau: Array, orders: tuple[float, ...]) -> FirstFit:
    kept = dict(base)
    for name in ("drag", "inertia"):  # friction is what slow motion shows
        others = np.column_stack([*(x for key, x in kept.items() if key != name), own])
        rest = base[name] - others @ np.linalg.lstsq(others, base[name], rcond=1e-9)[0]
        if float(np.linalg.norm(rest)) < BESIDE * float(np.linalg.norm(base[name])):
            del kept[name]
    A = np.column_stack([*kept.values(), own])
    A = A / (size := np.maximum(np.linalg.norm(A, axis=0), 1e-300))
    x, *_ = np.linalg.lstsq(A, tau, rcond=1e-9)
    free = max(len(tau) / (2 * OVER) - A.shape[1], 1.0)  # smoothed samples go together
    left = tau - A @ x
    deviation = np.sqrt(np.diag(np.linalg.pinv(A.T @ A)) * float(left @ left) / free)
    clear = x > CLEAR * deviation
    values = {name: float(x[k] / size[k]) for k, name in enumerate(kept) if clear[k]}
    return FirstFit(values.get("inertia"), values.get("drag"), values.get("friction"), orders)
