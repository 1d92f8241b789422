"""The balance integrated against test functions: one row each, in blocks that can be held out.

    y_k = ∫ φ_k [τ_drive - what opposes motion by the plant file] dt        α_k = -∫ φ_k' ω dt  or  ∫ φ_k'' θ dt

No derivative of the data is taken for laws that are linear in the motion; those that are not see a smoothed one.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, vstack

from ema.core.records import Array
from ema.models import axis
from ema.models.axis_layout import row

from .course import Course
from .smooth import bumps_at, local_polynomial

if TYPE_CHECKING:
    from ema.discrepancy.axis.measured import Measured

    from .law import Acting, Law

HALVES = (4, 6, 9, 13, 20, 30, 45, 70, 100, 150, 220, 330)  # of a test function, in samples
QUIET = 0.1  # noise of the acceleration over its rms from which a test function is wide enough
STILL = 0.02  # noise of the torque that the inertia needs, over the drive's, from which it is
MAX_ROWS = 3000
LONGEST = 20.0  # test functions that a record has room for, at least
FEWEST = 40  # rows from which a regression is worth it
N_BLOCKS = 64  # the records are cut into about so many
N_FOLDS = 4  # interleaved: each holds out every fourth block
CREEP = 0.02  # of the rms speed: below, friction at rest and in sliding mix
SEEN = 3.0  # deviations of the smoothed speed that show a direction


@dataclass(frozen=True)
class Motion:
    """The samples of all courses in one row: arrays of shape (n_samples,).

    `drive` is the drive's torque; `known` what is left of it to accelerate the axis, by the plant file.
    `direction` is ±1 or, where the axis may rest, 0. `has_position` is False where the position was integrated.
    `dT` is the winding's temperature less 20 °C [K]; `gear_orders` are those at which a gear may err, per turn.
    `other` is angle, speed and acceleration of a neighbouring axis, which is the `neighbour` "inner" or "outer" one.
    `record` is which of `records` a sample is of.
    """

    t: Array
    theta: Array
    w: Array
    a: Array
    drive: Array
    known: Array
    direction: Array
    has_position: bool
    static: NDArray[np.bool_]
    other: tuple[Array, Array, Array] = (np.empty(0), np.empty(0), np.empty(0))
    neighbour: str = ""
    record: NDArray[np.int_] = field(default_factory=lambda: np.empty(0, int))
    records: tuple[str, ...] = ()
    dT: Array = field(default_factory=lambda: np.empty(0))
    gear_orders: tuple[float, ...] = ()


@dataclass(frozen=True)
class Rows:
    """Rows of the regression.

    Attributes
    ----------
    y, drive, alpha : arrays, shape (n_rows,)
        What is to be explained, the drive's torque [N m or N], and the acceleration [rad/s² or m/s²].
    integrate, differentiate : sparse arrays, shape (n_rows, n_samples)
        ∫ φ f dt and -∫ φ' f dt of what is known at the samples.
    block : array of int, shape (n_rows,)
        Which block a row lies in. Rows that lie across two have a `whole` of False: they are fitted, not held out.
    sigma : array, shape (n_rows,)
        Noise of y - J α at the plant file's inertia.
    half : float
        Half width of the test functions. [s]
    """

    motion: Motion
    y: Array
    drive: Array
    alpha: Array
    integrate: csr_array
    differentiate: csr_array
    block: NDArray[np.int_]
    whole: NDArray[np.bool_]
    record: NDArray[np.int_]
    sigma: Array
    half: float
    known: dict[str, list[Array]] = field(default_factory=dict)

    def of(self, law: Law, acting: Acting) -> list[Array]:
        """Columns of a law over the rows; those that do not depend on what else acts are integrated once."""
        if law.repeats is not None:  # no row lies across two records
            own = self.of(law.repeats, acting)
            return [column * (self.record == k) for k in range(len(self.motion.records)) for column in own]
        if law.needs_acting:
            return [self.integrate @ column for column in law.columns(self.motion, acting)]
        if law.key not in self.known:
            parts = (
                law.weak(self.motion) if law.weak else [(column, None) for column in law.columns(self.motion, acting)]
            )
            self.known[law.key] = [
                self.integrate @ column + (0.0 if momentum is None else self.differentiate @ momentum)
                for column, momentum in parts
            ]
        return self.known[law.key]

    @property
    def n_blocks(self) -> int:
        """Number of blocks."""
        return int(self.block.max()) + 1 if len(self.block) else 0


def rows(
    plant: Measured, courses: list[Course], halves: dict[str, float] | None = None, unsure: float = 0.0
) -> Rows | None:
    """Rows of all courses; None where there are too few to say anything. `halves`: half widths by record. [s]

    `unsure`: share of a row in which the axis may rest; where 0, it also turns round in none.
    """
    widths = halves or half_widths(courses)
    total = sum(float(np.ptp(c.t)) for c in courses if not c.static) or 1.0
    length = max(total / N_BLOCKS, 4.0 * max(widths.values(), default=0.0))
    n_rows = {c.record: 0.0 for c in courses}
    for c in courses:
        n_rows[c.record] += len(c.t) if c.static else 2.0 * float(np.ptp(c.t)) / widths[c.record]
    thin = max(1.0, sum(n_rows.values()) / MAX_ROWS)
    names = list(dict.fromkeys(c.record for c in courses))
    model = plant.model({})
    motions, pieces, matrices, derivatives, offset, block = [], [], [], [], 0, 0
    for c in courses:
        motion = _at_rest(plant, model, c) if c.static else _motion(plant, model, c, widths[c.record])
        motions.append(motion)
        n = len(c.t)
        if c.static:
            matrix = _means(n, max(1, round(thin)))
            slopes = csr_array(matrix.shape)
            centres = np.arange(matrix.shape[0])
            alpha, own, whole = np.zeros(len(centres)), np.full(len(centres), block), np.ones(len(centres), bool)
            sigma = np.full(len(centres), c.noise["drive"] * _per_drive(plant, c) / max(1, round(thin)) ** 0.5)
        else:
            matrix, slopes, alpha, centres, sigma = _weak(plant, c, motion, widths[c.record], thin, unsure)
            place = (c.t[centres] - c.t[0]) / length
            own = block + place.astype(int)
            near = np.abs(place - np.round(place)) * length
            whole = (near > widths[c.record]) | (place < 0.5) | (length < 4.0 * widths[c.record])
        if len(centres):
            block = int(own.max()) + 1
        pieces.append((alpha, own, whole, np.full(len(centres), names.index(c.record)), sigma))
        matrices.append((matrix, offset, n))
        derivatives.append((slopes, offset, n))
        offset += n
    alpha, own, whole, record, sigma = (np.concatenate(column) for column in zip(*pieces, strict=True))
    if len(alpha) < FEWEST:
        return None
    join = _stacked(matrices, offset)
    of_record = np.repeat([names.index(c.record) for c in courses], [len(c.t) for c in courses])
    motion = replace(_joined(motions), record=of_record, records=tuple(names))
    _, own = np.unique(own, return_inverse=True)
    half = float(np.median(list(widths.values()))) if widths else 0.0
    known, drive, slopes = join @ motion.known, join @ motion.drive, _stacked(derivatives, offset)
    return Rows(motion, known, drive, alpha, join, slopes, own, whole, record, sigma, half)


def half_widths(courses: list[Course], inertia: float = 0.0, drive: float = 0.0) -> dict[str, float]:
    """By record, the narrowest test function over which the acceleration is clearly seen. [s]

    With the rms of the drive's torque, and the inertia, also the torque that it needs.
    """
    out: dict[str, float] = {}
    for record in dict.fromkeys(c.record for c in courses if not c.static):
        own = [c for c in courses if c.record == record]
        period = float(np.median([c.period for c in own]))
        longest = max(float(np.ptp(c.t)) for c in own)
        for half in HALVES:
            out[record] = (half + 0.5) * period
            found, noise = zip(*(_acceleration(c, out[record]) for c in own), strict=True)
            seen, noise_ = (float(np.mean(np.concatenate(x) ** 2)) for x in (found, noise))
            if noise_ < QUIET**2 * seen and inertia**2 * noise_ <= (STILL * drive) ** 2:
                break
            if LONGEST * out[record] > longest:
                break
    return out


def _acceleration(c: Course, half: float) -> tuple[Array, Array]:
    """∫ φ dω/dt and its noise, at about a hundred places."""
    step = max(1, len(c.t) // 100)
    index, _, first, second, whole = bumps_at(c.t, np.arange(0, len(c.t), step), half)
    value, noise = _alpha(c, index, first, second)
    return value[whole], noise[whole]


def _alpha(c: Course, index: NDArray[np.int_], first: Array, second: Array) -> tuple[Array, Array]:
    """Acceleration from the position or, where that is quieter by far, from the speed; and its noise."""
    out = []
    for x, weights, role in ((c.position, second, "position"), (c.speed, first, "speed")):
        if x is not None:
            noise = c.noise.get(role, 0.0) * np.sqrt((weights**2).sum(axis=1))
            centre = x[index[:, :1]]  # sums of large numbers lose digits
            out.append((((x[index] - centre) * weights).sum(axis=1), noise))
    if len(out) == 2 and np.median(out[1][1]) > 0.2 * np.median(out[0][1]):
        return out[0]  # the position is what the axis did; a drive's speed is often late
    return out[-1]


def _weak(
    plant: Measured, c: Course, m: Motion, half: float, thin: float, unsure: float
) -> tuple[csr_array, csr_array, Array, NDArray[np.int_], Array]:
    step = max(1, round(0.5 * thin * half / c.period))
    centres = np.arange(0, len(c.t), step)
    index, phi, first, second, whole = bumps_at(c.t, centres, half)
    alpha, noise = _alpha(c, index, first, second)
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
        _per_drive(plant, c) * c.noise.get("drive", 0.0) * np.sqrt((phi**2).sum(axis=1)),
    )
    weights = (csr_array((x.ravel(), columns), shape=shape) for x in (phi, first))
    return (*weights, alpha[good], centres, sigma)


def _per_drive(plant: Measured, c: Course) -> float:
    """Torque per unit of the drive channel."""
    p, kind = plant.plant, c.bench.roles.kind
    k_t = 1.0 if kind == "force" else float(p.k_t or 1.0)
    if kind == "voltage":
        return k_t / max(float(p.R or 0.0), 1e-9)
    return k_t * (p.loop.K_w if p.loop and kind == "speed-loop" else 1.0)


def _motion(plant: Measured, model: axis.Model, c: Course, half: float) -> Motion:
    n_half = max(3, round(half / c.period))
    if c.position is not None:
        theta, w, a = local_polynomial(c.t, c.position, n_half, 3)[:3]
        noise = c.noise.get("position", 0.0) / (n_half**1.5 * c.period)
    elif c.speed is not None:
        w, a = local_polynomial(c.t, c.speed, n_half, 2)[:2]
        noise = c.noise.get("speed", 0.0) / n_half**0.5
        theta = np.concatenate(([0.0], np.cumsum(np.diff(c.t) * 0.5 * (w[1:] + w[:-1]))))
    theta = theta + c.zero
    rest = max(SEEN * noise, CREEP * float(np.sqrt(np.mean(w**2))))
    direction = np.where(np.abs(w) > rest, np.sign(w), 0.0)
    i, drive = _current(c, w, model.z)
    is_force = c.bench.roles.kind == "force"
    known = axis.torque_along(model, theta, w, i, c.t, c.dT, force=is_force)
    still = np.zeros(len(w), bool)
    motion = Motion(c.t, theta, w, a, drive, known, direction, c.position is not None, still, dT=c.dT)
    motion = replace(motion, gear_orders=tuple(plant.plant.gear_orders))
    if c.other is None or plant.plant.neighbour is None:
        return motion
    psi, v, accelerates = local_polynomial(c.t, c.other, n_half, 3)[:3]
    return replace(motion, other=(psi, v, accelerates), neighbour=plant.plant.neighbour)


def _at_rest(plant: Measured, model: axis.Model, c: Course) -> Motion:
    assert c.position is not None
    assert c.direction is not None
    k_t = float(plant.plant.k_t or 1.0)
    theta = c.position + c.zero
    held = axis.holding(model, theta, c.direction, c.t)
    zero = np.zeros(len(c.t))
    drive = k_t * c.drive
    return Motion(
        c.t, theta, zero, zero, drive, drive - k_t * held, c.direction, True, np.ones(len(c.t), bool), dT=c.dT
    )  # fmt: skip


def _current(c: Course, w: Array, z: Array) -> tuple[Array, Array]:
    """Current (or force) along the motion, and the drive's torque."""
    kind, k_t = c.bench.roles.kind, float(z[row("k_t")])
    at = c.t - c.late * c.period
    drive = (np.interp(at, c.t, c.drive) - z[row("drive_offset.offset")]) / (1.0 + z[row("drive_gain.gain")])
    if kind == "force":
        return drive, drive
    if c.current is not None:
        drive = c.current
    elif kind == "voltage":  # quasi-static: the electrical time constant is shorter than a test function
        drive = (drive - z[row("k_e")] * w) / max(float(z[row("R")]), 1e-9)
    elif kind == "speed-loop":
        drive = np.clip(z[row("K_w")] * (drive - w), -z[row("I_max")], z[row("I_max")])
    return drive, k_t * drive


def _means(n: int, every: int) -> csr_array:
    """Means over `every` readings that follow each other."""
    m = max(n // every, 1)
    at = np.minimum(np.arange(n) // every, m - 1)
    count = np.bincount(at, minlength=m)
    return csr_array((1.0 / count[at], (at, np.arange(n))), shape=(m, n))


def _stacked(matrices: list[tuple[csr_array, int, int]], total: int) -> csr_array:
    parts = []
    for matrix, offset, _ in matrices:
        m = matrix.tocoo()
        parts.append(csr_array((m.data, (m.row, m.col + offset)), shape=(matrix.shape[0], total)))
    return csr_array(vstack(parts))


def _joined(motions: list[Motion]) -> Motion:
    def of(name: str) -> Array:
        return np.concatenate([getattr(m, name) for m in motions])

    columns = (of("t"), of("theta"), of("w"), of("a"), of("drive"), of("known"), of("direction"))
    motion = Motion(*columns, all(m.has_position for m in motions), of("static").astype(bool), dT=of("dT"))
    motion = replace(motion, gear_orders=motions[0].gear_orders)
    if not all(m.neighbour for m in motions):
        return motion
    psi, v, a = (np.concatenate([m.other[k] for m in motions]) for k in range(3))
    return replace(motion, other=(psi, v, a), neighbour=motions[0].neighbour)
