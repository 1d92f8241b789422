"""Torque residual along the measured motion, integrated against test functions: no derivative of data is taken.

    y_k = ∫ φ_k [τ_m - C ω - τ_friction - τ_effects] dt  +  J ∫ φ_k' ω dt        (or  - J ∫ φ_k'' θ dt)

is what further torques τ must explain:  y_k = ∫ φ_k τ dt + noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csr_array

from ema.discrepancy.axis.naming.naming import numbers_of
from ema.models import axis
from ema.models.axis_layout import row

if TYPE_CHECKING:
    from ema.core.records import Array
    from ema.discrepancy.axis.reading.measured import Measured
    from ema.discrepancy.axis.reading.windows import Bench, Window
    from ema.discrepancy.plant import Point
    from ema.effects.search import AxisSizes

HALF_WIDTHS = (3, 5, 8, 12, 20, 32, 50)  # of a test function, in samples
FEWEST, MAX_ROWS = 30, 2500  # test functions with which regressions are worth it, and with which they stay quick
QUIET = 0.2  # noise of y over the drive torque at which a test function is wide enough


@dataclass(frozen=True)
class Motion:
    """What was measured, aligned in time, one array over all blocks: position, speed, current, time, direction."""

    theta: Array
    w: Array
    i: Array
    t: Array
    direction: Array
    dT: Array


@dataclass(frozen=True)
class Weak:
    """Weak-form data.

    Attributes
    ----------
    y : array, shape (n_y,)
        Torque residual. [N m or N]
    sigma : array, shape (n_y,)
        Its noise. [N m or N]
    motion : Motion, arrays of shape (n_samples,)
    inertia : array, shape (n_y,)
        ∫ φ_k dω/dt: what a change of inertia would add. [rad/s²]
    index, weight : arrays, shape (n_y, width)
        Test function k is ``weight[k]`` on samples ``index[k]`` of the motion; weights sum to one.
    block : array of int, shape (n_y,)
        Block of each test function.
    """

    y: Array
    sigma: Array
    inertia: Array
    motion: Motion
    index: np.ndarray
    weight: Array
    block: np.ndarray

    @cached_property
    def _matrix(self) -> csr_array:
        rows = np.repeat(np.arange(len(self.y)), self.index.shape[1])
        shape = (len(self.y), len(self.motion.theta))
        return csr_array((self.weight.ravel(), (rows, self.index.ravel())), shape=shape)

    def integrate(self, f: Array) -> Array:
        """∫ φ_k f dt of values at the motion's samples, shape (n_samples,) or (n_samples, n_columns)."""
        return np.asarray(self._matrix @ f)

    def always(self) -> list[Array]:
        """What may always be other than in the plant file, (n_y,) each: a constant, friction, drag, inertia."""
        m = self.motion
        return [*(self.integrate(f) for f in (np.ones(len(m.theta)), np.sign(m.direction), m.w)), self.inertia]

    def beside(self) -> tuple[Array, Array]:
        """Orthonormal columns (n_y, 4) of `always` over σ, and what y/σ has beside them."""
        q, _ = np.linalg.qr(np.stack(self.always(), axis=1) / self.sigma[:, None])
        y = self.y / self.sigma
        return q, y - q @ (q.T @ y)

    def __getitem__(self, chosen: np.ndarray) -> Weak:
        columns = (self.y[chosen], self.sigma[chosen], self.inertia[chosen])
        return Weak(*columns, self.motion, self.index[chosen], self.weight[chosen], self.block[chosen])


def weak_form(plant: Measured, point: Point, blocks: Sequence[int]) -> Weak:
    """Weak-form residual of the model at `point`; of at most `MAX_ROWS` test functions, evenly."""
    model = plant.model(point)
    zeros = numbers_of(point).zeros
    parts: list[tuple[Array, ...]] = []
    pieces: list[Weak] = []
    offset = 0
    for j in blocks:
        w, b = plant.windows[j], plant.bench_of(j)
        zero = zeros.get(b.name, 0.0)
        if w.static:
            assert w.direction is not None
            k_t = 1.0 if plant.plant.is_force else float(plant.plant.k_t or 1.0)
            held = axis.holding(model, w.position + zero, w.direction, w.t, w.load)
            y = k_t * (w.drive - held)
            index = np.arange(w.n)[:, None] + offset
            sigma = np.full(w.n, np.hypot(k_t * b.noise[b.roles.drive].sigma, b.load_noise))
            piece = _piece(y, sigma, np.zeros(w.n), index, np.ones((w.n, 1)), j)
            parts.append((w.position + zero, w.direction * 1e-9, w.drive, w.t, w.direction, np.full(w.n, w.dT)))
        else:
            piece, sampled = _moving(plant, model, j, offset, zero)
            parts.append(sampled)
        pieces.append(piece)
        offset += w.n
    motion = Motion(*(np.concatenate(column) for column in zip(*parts, strict=True)))
    width = max(p.index.shape[1] for p in pieces)
    index = np.concatenate([_padded(p.index, width, repeat=True) for p in pieces])
    weight = np.concatenate([_padded(p.weight, width, repeat=False) for p in pieces])
    join = [np.concatenate([getattr(p, name) for p in pieces]) for name in ("y", "sigma", "inertia", "block")]
    y, sigma, inertia, block = join
    weak = Weak(y, sigma, inertia, motion, index, weight, block.astype(int))
    return weak if len(y) <= MAX_ROWS else weak[np.unique(np.linspace(0, len(y) - 1, MAX_ROWS).astype(int))]


def _piece(y: Array, sigma: Array, inertia: Array, index: np.ndarray, weight: Array, block: int) -> Weak:
    empty = np.empty(0)
    return Weak(y, sigma, inertia, Motion(*(empty,) * 6), index, weight, np.full(len(y), block))


def _padded(x: np.ndarray, width: int, *, repeat: bool) -> np.ndarray:
    more = width - x.shape[1]
    return np.pad(x, ((0, 0), (0, more)), mode="edge") if repeat else np.pad(x, ((0, 0), (0, more)))


def bump(half: int, power: int = 4) -> tuple[Array, Array, Array]:
    """Bump (1 - s²)^p on 2 `half` + 1 samples with unit sum, and its first and second derivative per sample.

    As sums these hold exactly what they do as integrals: ∫ φ' t = -1, ∫ φ'' = 0, ∫ φ'' t²/2 = 1. An angle far from
    zero would else be a torque.
    """
    s = np.linspace(-1.0, 1.0, 2 * half + 3)[1:-1]
    n = np.arange(-half, half + 1)
    phi = (1.0 - s**2) ** power
    first = power * (1.0 - s**2) ** (power - 1) * (-2.0 * s)
    second = power * ((power - 1) * (1.0 - s**2) ** (power - 2) * 4.0 * s**2 - 2.0 * (1.0 - s**2) ** (power - 1))
    phi /= phi.sum()
    second -= second.sum() * phi
    return phi, -first / (first @ n), 2.0 * second / (second @ n**2)


def _moving(plant: Measured, model: axis.Model, j: int, offset: int, zero: float) -> tuple[Weak, tuple[Array, ...]]:
    p, w, b = plant.plant, plant.windows[j], plant.bench_of(j)
    z = model.z
    dt = w.period * (1.0 + z[row("clock_skew.rate")])
    late = z[row("position_delay.time")], z[row("speed_delay.time")]
    theta = np.interp(w.t + late[0], w.t, w.position)
    speed_row = b.roles.outputs.index(b.roles.speed) if b.roles.speed else None
    raw_w = w.speed if speed_row is None else w.outputs[speed_row]
    speed = np.interp(w.t + late[1], w.t, w.speed)
    raw_w = np.interp(w.t + late[1], w.t, raw_w)
    acting = axis.acting_drive(axis.lag_of_drive(model, b.roles.kind), w.part.t, w.part.drive, plant.between)
    drive = (w.drive_by(axis.clock_of_drive(model), acting=acting) - z[row("drive_offset.offset")]) / (
        1.0 + z[row("drive_gain.gain")]
    )
    i, k_t = _current(b, w, drive, speed, z)
    dT = np.full(w.n, w.dT)
    J = model.inertia
    known = axis.torque_along(model, theta + zero, speed, i, w.t, dT, w.load, force=b.roles.kind == "force")
    sigma_w = b.noise[b.roles.speed].sigma if b.roles.speed else 0.0
    sigma_theta = b.noise[str(b.roles.position)].sigma if not b.roles.speed else 0.0
    current = "i_q" if "i_q" in b.roles.outputs else b.roles.drive
    sigma_tau = k_t * b.noise[current].sigma / (float(p.R or 1.0) if current == "u_q" else 1.0)
    sigma_tau = float(np.hypot(sigma_tau, b.load_noise))
    loudness = max(float(np.std(known)), float(np.std(k_t * i)), 1e-300)
    for half in HALF_WIDTHS:
        phi, first, second = bump(half)
        noise = np.sqrt(
            (phi**2).sum() * sigma_tau**2
            + (first**2).sum() * (J * sigma_w / dt) ** 2
            + (second**2).sum() * (J * sigma_theta / dt**2) ** 2
        )
        if noise < QUIET * loudness or 4 * half > w.n:
            break
    centres = np.arange(half, w.n - half, max(1, half // 2))
    index = centres[:, None] + np.arange(-half, half + 1)
    if b.roles.speed:
        inertia = -(raw_w[index] @ first) / dt
    else:
        position = w.outputs[b.roles.outputs.index(str(b.roles.position))]
        inertia = (np.interp(w.t + late[0], w.t, position)[index] @ second) / dt**2
    by_angle, _ = axis.inertia_by_angle(model, theta + zero)
    uneven = -(by_angle * speed)[index] @ first / dt  # of the momentum, what is not the mean inertia's
    y = known[index] @ phi - J * inertia - uneven
    steady = (np.sign(speed[index]) == np.sign(speed[centres])[:, None]).all(axis=1)  # no reversal, no standstill
    steady &= np.abs(speed[centres]) > 2.0 * sigma_w / np.sqrt(half)
    piece = _piece(y, np.full(len(y), noise), inertia, index + offset, np.tile(phi, (len(y), 1)), j)[steady]
    return piece, (theta + zero, speed, i, w.t, np.sign(speed), dT)


def _current(b: Bench, w: Window, drive: Array, speed: Array, z: Array) -> tuple[Array, float]:
    """Current (or force) along the motion and the torque per unit of it."""
    kind = b.roles.kind
    if kind == "force":
        return drive, 1.0
    k_t = float(z[row("k_t")])
    if "i_q" in b.roles.outputs:
        return w.outputs[b.roles.outputs.index("i_q")], k_t
    if kind == "voltage":  # quasi-static: the electrical time constant is shorter than a test function
        return (drive - z[row("k_e")] * speed) / max(float(z[row("R")]), 1e-9), k_t
    if kind == "speed-loop":
        asked = np.clip(z[row("K_w")] * (drive - speed), -z[row("I_max")], z[row("I_max")])
        return axis.acting_drive(float(z[row("drive_lag.time")]), w.t, asked), k_t
    return drive, k_t


def fit_frictions(weak: Weak, always: Array, columns: Array) -> tuple[float, Array]:
    """By how much friction is another everywhere, and coefficients of `columns` (n_y, n) over σ beside that. [N m]"""
    A = np.column_stack([always / weak.sigma[:, None], columns])
    (_, everywhere, *_), own = np.split(
        np.linalg.lstsq(A, weak.y / weak.sigma, rcond=None)[0], [always.shape[1]]
    )  # fmt: skip
    return float(everywhere), own


def bound_friction(plant: Measured, s: AxisSizes, point: Point, more: float) -> float:
    """Friction at a point and `more`, within where it is searched and above nothing. [N m or N]"""
    friction = next(f for f in plant.base if f.name == "F_d")
    return float(np.clip(point["F_d"] + more, max(friction.low, 1e-3 * s.torque), friction.high))
