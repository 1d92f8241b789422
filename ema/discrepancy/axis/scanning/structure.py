"""Terms that the torque residual suggests when no effect of the library explains it.

Forward selection over a dictionary of torque terms on the weak-form residual (`weak_form`); the engine then accepts a
term only if simulations of held-out blocks improve.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ema.core.records import Array
from ema.discrepancy.axis.reading.sizes import sizes
from ema.discrepancy.plant import Candidate, Free, Point
from ema.effects.search import AxisSizes
from ema.effects.torque_term import COLUMNS, EVEN, NEUTRAL, power

from .weak_form import FEWEST, Motion, Weak, weak_form

if TYPE_CHECKING:
    from ema.discrepancy.axis.reading.measured import Measured

N_GRID = 300  # members of a family at most
N_CENTRES = 24
N_SUGGESTIONS = 4
ONE_SINE = 0.5  # of the power of the speed in one line
MIN_GAIN = 0.01  # of the weak-form residual's power


@dataclass(frozen=True)
class Term:
    """A member of a family of terms: its columns over the motion and the values of `torque_term` it stands for.

    The columns are without the current, which multiplies what their test functions see of them.
    """

    family: str
    columns: tuple[Array, ...]
    values: dict[str, float]
    refine: dict[str, tuple[float, float, float]]  # column → (low, high, scale)


def search(plant: Measured, point: Point, blocks: Sequence[int]) -> list[Candidate]:
    """The best member of each family, the one that explains most first."""
    weak = weak_form(plant, point, blocks)
    if len(weak.y) < FEWEST:
        return []
    m = weak.motion
    q, rest = weak.beside()
    needed = _needed_drive(plant, weak)
    best: dict[str, tuple[float, Term, Array]] = {}
    for family, terms in _families(m, sizes(plant), _own_frequency(plant)).items():
        for gain, term, coefficients in _gains(weak, terms, needed, q, rest):
            if gain > best.get(family, (0.0,))[0]:
                best[family] = (gain, term, coefficients)
    least = MIN_GAIN * float(rest @ rest)
    ranked = sorted((b for b in best.values() if b[0] > least), key=lambda b: -b[0])
    number = 1 + len({name.split(".")[0] for name in point if name.startswith("term")})
    return [_candidate(f"term{number}", term, c, plant) for _, term, c in ranked[:N_SUGGESTIONS]]


def _families(m: Motion, s: AxisSizes, own: float) -> dict[str, list[Term]]:
    out: dict[str, list[Term]] = {}
    for term in _dictionary(m, s, own):
        out.setdefault(term.family, []).append(term)
    return out


def _needed_drive(plant: Measured, weak: Weak) -> Array:
    """Current (or force) that the model needs over each test function, (n_y,).

    What is recorded holds the torque that is looked for: the residual would be a function of itself.
    """
    k_t = 1.0 if plant.plant.is_force else float(plant.plant.k_t or 1.0)
    return np.asarray(weak.integrate(weak.motion.i) - weak.y / k_t)


def _gains(
    weak: Weak, terms: Sequence[Term], needed: Array, q: Array, rest: Array
) -> Iterator[tuple[float, Term, Array]]:
    """Power of the residual that each term of a family explains beside `q`, and its coefficients."""
    parts = [np.stack(columns, axis=1) for columns in zip(*(t.columns for t in terms), strict=True)]
    exponent = terms[0].values.get("current_power", 0.0)
    factor = np.array([power(i, exponent) for i in needed]) / weak.sigma
    own = [weak.integrate(part) * factor[:, None] for part in parts]
    left = [part - q @ (q.T @ part) for part in own]
    left = [np.where(_norms(b) < 1e-3 * _norms(a), 0.0, b) for a, b in zip(own, left, strict=True)]
    for k, term in enumerate(terms):
        A = np.stack([part[:, k] for part in left], axis=1)
        gram, b = A.T @ A, A.T @ rest
        coefficients = np.linalg.pinv(gram, rcond=1e-9, hermitian=True) @ b
        yield float(b @ coefficients), term, coefficients


def _norms(columns: Array) -> Array:
    return np.asarray(np.linalg.norm(columns, axis=0))


def _dictionary(m: Motion, s: AxisSizes, own: float) -> Iterator[Term]:
    sign, one = np.sign(m.direction), np.ones(len(m.theta))
    span = float(np.ptp(m.theta))
    duration = float(np.ptp(m.t))
    simple: tuple[tuple[str, Array, dict[str, float]], ...] = (
        ("quadratic in speed", m.w * np.abs(m.w), {"speed_power": 2.0}),
        ("proportional to current", one, {"current_power": 1.0}),
        ("quadratic in current", one, {"current_power": 2.0}),
        ("even in current", one, {"current_power": EVEN}),
        ("even in speed", np.abs(m.w), {"speed_power": EVEN}),
        ("speed times current", m.w, {"speed_power": 1.0, "current_power": 1.0}),
    )
    for family, f, values in simple:
        yield Term(family, (f,), values, {})
    if span > 0.0:
        resolution = 2.0 * np.pi / span
        lines: tuple[tuple[str, Array, dict[str, float]], ...] = (
            ("angle line", one, {}),
            ("angle line of friction", sign, {"is_friction": 1.0}),
            ("angle line times current", one, {"current_power": 1.0}),
        )
        for family, factor, values in lines:
            for n in np.linspace(resolution, min(resolution * N_GRID / 2, 260.0), N_GRID):
                refine = {"order": (max(n - resolution, 0.0), n + resolution, 0.1 * resolution)}
                columns = (factor * np.cos(n * m.theta), factor * np.sin(n * m.theta))
                yield Term(family, columns, {**values, "order": float(n)}, refine)
        yield from _bumps("position", m.theta, one, sign)
    if duration > 0.0:
        resolution = 1.0 / duration
        frequencies = np.linspace(resolution, min(resolution * N_GRID / 2, 0.2 / s.period), N_GRID)
        for f in frequencies:
            if own and abs(f - own * max(round(f / own), 1)) < resolution:
                continue  # whatever depends on the motion swings with it
            a = 2.0 * np.pi * f * m.t
            refine = {"frequency": (max(f - resolution, 0.0), f + resolution, 0.1 * resolution)}
            yield Term("time line", (np.cos(a), np.sin(a)), {"frequency": float(f)}, refine)
        yield from _bumps("time", m.t, one, sign)


def _own_frequency(plant: Measured) -> float:
    """Frequency of a motion that is little more than one sine, 0 of any other.   [Hz]"""
    moving = [w for w in plant.windows if not w.static]
    if not moving:
        return 0.0
    t, w = (np.concatenate([getattr(window, name) for window in moving]) for name in ("t", "speed"))
    w = w - w.mean()
    resolution = 0.5 / max(float(np.ptp(t)), 1e-9)
    frequencies = resolution * np.arange(1, N_GRID + 1)
    swing = np.array([abs(np.exp(2j * np.pi * f * t) @ w) for f in frequencies])
    share = 2.0 * swing**2 / max(len(w) * float(w @ w), 1e-300)
    return float(frequencies[np.argmax(share)]) if share.max() > ONE_SINE else 0.0


def _bumps(what: str, x: Array, one: Array, sign: Array) -> Iterator[Term]:
    low, high = float(x.min()), float(x.max())
    name = "angle" if what == "position" else "time"
    for width in (0.03, 0.08, 0.2):
        w = width * (high - low)
        for c in np.linspace(low, high, N_CENTRES):
            bump = np.exp(-(((x - c) / w) ** 2))
            refine = {f"{name}_centre": (low, high, 0.2 * w), f"{name}_width": (0.2 * w, 5.0 * w, 0.2 * w)}
            values = {f"{name}_centre": float(c), f"{name}_width": float(w)}
            yield Term(f"friction around a {what}", (sign * bump,), {**values, "is_friction": 1.0}, refine)
            yield Term(f"torque around a {what}", (bump,), values, refine)


def _candidate(key: str, term: Term, c: Array, plant: Measured) -> Candidate:
    size = float(np.abs(c).max())
    unit = "N m"
    start = {f"{key}.{name}": value for name, value in zip(COLUMNS, NEUTRAL, strict=True)}
    start |= {f"{key}.{name}": value for name, value in term.values.items()}
    free = [Free(f"{key}.coefficient", unit, -20.0 * size, 20.0 * size, 0.0, 0.1 * size, 2e-3 * size)]
    if len(c) == 2:
        phase_name = "angle_phase" if "order" in term.values else "time_phase"
        start[f"{key}.coefficient"] = float(np.hypot(*c))
        start[f"{key}.{phase_name}"] = float(np.arctan2(c[0], c[1]))
        free.append(Free(f"{key}.{phase_name}", "rad", -10.0, 10.0, 0.0, 0.1, 1e-3))
    else:
        start[f"{key}.coefficient"] = float(c[0])
    for name, (low, high, scale) in term.refine.items():
        free.append(Free(f"{key}.{name}", "", low, high, 0.0, scale, 0.02 * scale))
    return Candidate(term.family, term.family, tuple(free), (start,), is_structure=True)
