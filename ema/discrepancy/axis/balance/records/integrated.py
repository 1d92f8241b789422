"""The balance integrated against test functions: one row for each.

    y_k = ∫ φ_k [τ_drive - what opposes motion by the plant file] dt        α_k = -∫ φ_k' ω dt  or  ∫ φ_k'' θ dt

No derivative of the data is taken for laws that are linear in the motion; those that are not see a smoothed one.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, vstack

from ema.core.records import Array
from ema.discrepancy.axis.balance.laws.motion import Motion
from ema.discrepancy.axis.balance.regressing.rows import Rows
from ema.discrepancy.axis.reading.smooth import bumps_at

from .course import Course
from .sampled import at_rest, join, smooth_motion
from .widths import acceleration, half_widths

if TYPE_CHECKING:
    from ema.discrepancy.axis.reading.measured import Measured

MAX_ROWS = 3000
FEWEST = 40  # rows from which a regression is worth it
SMOOTHED = 0.5  # of a test function's width, over which a motion that is seen clearly is smoothed
N_BLOCKS = 64  # the records are cut into about so many


def integrate_rows(
    plant: Measured,
    courses: list[Course],
    halves: dict[str, float] | None = None,
    unsure: float = 0.0,
    seen: dict[str, float] | None = None,
) -> Rows | None:
    """Rows of all courses; None where there are too few to say anything. `halves`: half widths by record. [s]

    `seen`: half widths over which the motion is seen clearly, where those of the rows are wider: it is smoothed less
    then, since a pendulum acts where the axis is. `unsure`: share of a row in which the axis may rest; where 0, it also
    turns round in none.
    """
    widths = halves or half_widths(courses)
    smooth = {r: max(seen[r], SMOOTHED * half) for r, half in widths.items()} if seen else widths
    total = sum(float(np.ptp(c.t)) for c in courses if not c.static) or 1.0
    widest = max(widths.values(), default=0.0)
    length, short = max(total / N_BLOCKS, 4.0 * widest), max(total / N_BLOCKS, 2.0 * widest)
    n_rows = {c.record: 0.0 for c in courses}
    for c in courses:
        n_rows[c.record] += len(c.t) if c.static else 2.0 * float(np.ptp(c.t)) / widths[c.record]
    thin = max(1.0, sum(n_rows.values()) / MAX_ROWS)
    names = list(dict.fromkeys(c.record for c in courses))
    model = plant.model({})
    motions, pieces, matrices, derivatives, offset, block, piece = [], [], [], [], 0, 0, 0
    for c in courses:
        motion = at_rest(plant, model, c) if c.static else smooth_motion(plant, model, c, smooth[c.record])
        motions.append(motion)
        n = len(c.t)
        if c.static:
            matrix = _means(n, max(1, round(thin)))
            slopes = csr_array(matrix.shape)
            centres = np.arange(matrix.shape[0])
            alpha, own, whole = np.zeros(len(centres)), np.full(len(centres), block), np.ones(len(centres), bool)
            cluster = np.full(len(centres), piece)
            sigma = np.full(len(centres), _torque_noise(plant, c) / max(1, round(thin)) ** 0.5)
        else:
            matrix, slopes, alpha, centres, sigma = _weak(plant, c, motion, widths[c.record], thin, unsure)
            place = (c.t[centres] - c.t[0]) / length
            own = block + place.astype(int)
            cluster = piece + ((c.t[centres] - c.t[0]) / short).astype(int)
            near = np.abs(place - np.round(place)) * length
            whole = (near > widths[c.record]) | (place < 0.5) | (length < 4.0 * widths[c.record])
        if len(centres):
            block, piece = int(own.max()) + 1, int(cluster.max()) + 1
        pieces.append((alpha, own, whole, cluster, np.full(len(centres), names.index(c.record)), sigma))
        matrices.append((matrix, offset, n))
        derivatives.append((slopes, offset, n))
        offset += n
    alpha, own, whole, cluster, record, sigma = (np.concatenate(column) for column in zip(*pieces, strict=True))
    if len(alpha) < FEWEST:
        return None
    stacked = _stack(matrices, offset)
    of_record = np.repeat([names.index(c.record) for c in courses], [len(c.t) for c in courses])
    motion = replace(join(motions), record=of_record, records=tuple(names))
    _, own = np.unique(own, return_inverse=True)
    half = float(np.median(list(widths.values()))) if widths else 0.0
    known, drive, slopes = stacked @ motion.known, stacked @ motion.drive, _stack(derivatives, offset)
    return Rows(motion, known, drive, alpha, stacked, slopes, own, whole, cluster, record, sigma, half)


def _weak(
    plant: Measured, c: Course, m: Motion, half: float, thin: float, unsure: float
) -> tuple[csr_array, csr_array, Array, NDArray[np.int_], Array]:
    step = max(1, round(0.5 * thin * half / c.period))
    centres = np.arange(0, len(c.t), step)
    index, phi, first, second, whole = bumps_at(c.t, centres, half)
    alpha, noise = acceleration(c, index, first, second)
    used = phi > 0.0
    direction = m.direction[index]
    one_way = (np.where(used, direction, 1.0) > 0.0).all(axis=1) | (np.where(used, direction, -1.0) < 0.0).all(axis=1)
    rests = (phi * (direction == 0.0)).sum(axis=1)
    good = whole & (one_way | (rests < unsure))
    index, phi, first, centres = index[good], phi[good], first[good], centres[good]
    shape = (len(centres), len(c.t))
    columns = (np.repeat(np.arange(len(centres)), index.shape[1]), index.ravel())
    sigma = np.hypot(
        plant.plant.inertia * noise[good],
        _torque_noise(plant, c) * np.sqrt((phi**2).sum(axis=1)),
    )
    weights = (csr_array((x.ravel(), columns), shape=shape) for x in (phi, first))
    return (*weights, alpha[good], centres, sigma)


def _torque_noise(plant: Measured, c: Course) -> float:
    """Of one sample, of what drives less a known load. [N m or N]"""
    return float(np.hypot(_per_drive(plant, c) * c.noise.get("drive", 0.0), c.noise.get("load", 0.0)))


def _per_drive(plant: Measured, c: Course) -> float:
    """Torque per unit of the drive channel."""
    p, kind = plant.plant, c.bench.roles.kind
    k_t = 1.0 if kind == "force" else float(p.k_t or 1.0)
    if kind == "voltage":
        return k_t / max(float(p.R or 0.0), 1e-9)
    return k_t * (p.loop.K_w if p.loop and kind == "speed-loop" else 1.0)


def _means(n: int, every: int) -> csr_array:
    """Means over `every` readings that follow each other."""
    m = max(n // every, 1)
    at = np.minimum(np.arange(n) // every, m - 1)
    count = np.bincount(at, minlength=m)
    return csr_array((1.0 / count[at], (at, np.arange(n))), shape=(m, n))


def _stack(matrices: list[tuple[csr_array, int, int]], total: int) -> csr_array:
    parts = []
    for matrix, offset, _ in matrices:
        m = matrix.tocoo()
        parts.append(csr_array((m.data, (m.row, m.col + offset)), shape=(matrix.shape[0], total)))
    return csr_array(vstack(parts))
