"""Cogging: which orders per turn the torque residual shows, and how strongly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import stats

from ema.core.records import Array
from ema.discrepancy.axis.naming.naming import line
from ema.discrepancy.plant import Candidate, Free, Point
from ema.effects.resolver_error import EFFECT as RESOLVER_ERROR

from .weak_form import FEWEST, Weak, weak_form

if TYPE_CHECKING:
    from ema.discrepancy.axis.reading.measured import Measured

MAX_ORDER = 240
MAX_LINES = 8
MIN_LINE = 0.03  # of the strongest line: weaker ones are not worth a name
ALARM = 1e-4  # of a line that is not there, over all orders
PER_TURN = (1.0, 2.0)  # times that an angle's error comes per turn
LARGEST_ERROR = max(p.high for p in RESOLVER_ERROR.parameters if p.unit == "rad")


@dataclass(frozen=True)
class Scan:
    """Result of a scan over orders: lines found, in the order found, with cosine and sine parts [N m];
    `inertia` is what the same regression says of the inertia to be added. [kg m²]
    """

    orders: tuple[float, ...]
    parts: Array
    inertia: float = 0.0


def scan(weak: Weak, orders: Array, max_lines: int = MAX_LINES) -> Scan:
    """Forward orthogonal selection of angle-locked lines beside friction, viscous drag, inertia and a constant."""
    y = weak.y / weak.sigma
    m = weak.motion
    A = np.stack(weak.always(), axis=1) / weak.sigma[:, None]
    angles = m.theta[:, None] * orders
    parts = [weak.integrate(f(angles)) / weak.sigma[:, None] for f in (np.cos, np.sin)]
    lines = np.stack(parts, axis=2).transpose(1, 0, 2)  # (n_orders, n_y, 2)
    resolvable = np.sqrt((lines**2).mean(axis=(1, 2))) > 0.1 * np.sqrt(np.mean(weak.sigma**-2.0) * 0.5)
    chosen: list[int] = []
    basis = _orthonormal(A)
    n_effective = max(len(y) / 4, 8)  # neighbouring test functions overlap
    while len(chosen) < max_lines:
        rest = y - basis @ (basis.T @ y)
        left = lines - np.einsum("ij,kjl->kil", basis, np.einsum("ij,kil->kjl", basis, lines))
        gain = np.array([_explained(block, rest) for block in left])
        gain[~resolvable] = 0.0
        gain[chosen] = 0.0
        best = int(np.argmax(gain))
        total = float(rest @ rest)
        f = (gain[best] / 2.0) / max((total - gain[best]) / max(len(y) - basis.shape[1] - 2, 1), 1e-300)
        p = stats.f.sf(f * n_effective / len(y), 2, n_effective) * int(resolvable.sum())
        if p > ALARM or gain[best] < 0.005 * total:
            break
        chosen.append(best)
        basis = _orthonormal(np.concatenate([A, *lines[chosen]], axis=1))
    if not chosen:
        return Scan((), np.empty((0, 2)))
    coefficients, *_ = np.linalg.lstsq(np.concatenate([A, *lines[chosen]], axis=1), y, rcond=None)
    found = coefficients[A.shape[1] :].reshape(-1, 2)
    return Scan(tuple(float(orders[k]) for k in chosen), found, float(coefficients[A.shape[1] - 1]))


def _orthonormal(A: Array) -> Array:
    u, s, _ = np.linalg.svd(A / np.maximum(np.linalg.norm(A, axis=0), 1e-300), full_matrices=False)
    return np.asarray(u[:, s > 1e-8 * s[0]])


def _explained(block: Array, rest: Array) -> float:
    """Part of |rest|² that the two columns of a line explain."""
    gram = block.T @ block
    if np.linalg.cond(gram) > 1e8:
        return 0.0
    b = block.T @ rest
    return float(b @ np.linalg.solve(gram, b))


def integer_orders(weak: Weak) -> Array:
    """Orders that the covered angle can tell from a constant."""
    span = float(np.ptp(weak.motion.theta))
    lowest = max(1, int(np.ceil(3.0 * np.pi / max(span, 1e-9))))
    return np.arange(lowest, MAX_ORDER + 1, dtype=float)


def _may_be_made_by_angle(found: Scan, k: int) -> bool:
    """Whether an angle that errs once or twice per turn may make a line of a stronger one beside it.

    sin(n (θ + e cos mθ)) has lines n ± m of n e / 2 (phase modulation). Such a line waits for a round of its own, in
    which an angle that errs is tried beside it.
    """
    size = np.hypot(*found.parts.T)
    return any(
        abs(found.orders[k] - n) in PER_TURN and size[k] < size[other] * min(n * LARGEST_ERROR / 2.0, 1.0)
        for other, n in enumerate(found.orders)
    )


def cogging_candidate(plant: Measured, point: Point, blocks: Sequence[int]) -> Candidate | None:
    """Lines of integer order that stand out of the torque residual, or None."""
    if plant.plant.is_linear:
        return None
    weak = weak_form(plant, point, blocks)
    orders = integer_orders(weak)
    if len(orders) == 0 or len(weak.y) < FEWEST:
        return None
    taken = {float(name.split(":")[1].rpartition(".")[0]) for name in point if name.startswith("cogging:")}
    found = scan(weak, np.array([n for n in orders if n not in taken]))
    known = [v for name, v in point.items() if name.startswith("cogging:")]
    size = float(np.abs(np.concatenate([found.parts.ravel(), known, [0.0]])).max())
    strong = [k for k, parts in enumerate(found.parts) if np.hypot(*parts) > MIN_LINE * size]
    strong = [k for k in strong if not _may_be_made_by_angle(found, k)]
    if not strong:
        return None
    found = Scan(tuple(found.orders[k] for k in strong), found.parts[strong], found.inertia)
    free, start = [], {}
    for n, (c, s) in zip(found.orders, found.parts, strict=True):
        for part, value in (("cos", c), ("sin", s)):
            name = line(n, part)
            free.append(Free(name, "N m", -20.0 * size, 20.0 * size, float(value), 0.1 * size, 1e-3 * size))
            start[name] = float(value)
    starts: list[dict[str, float]] = [start]
    if "J" in plant.plant.fitted:
        J = next(f for f in plant.base if f.name == "J")
        starts.append({**start, "J": min(max(float(point["J"]) + found.inertia, J.low), J.high)})
    return Candidate("cogging", "cogging", tuple(free), tuple(starts))
