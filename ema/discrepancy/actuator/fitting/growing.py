"""Faults that grow while a record is made: the simulation may be right in every cycle, with faults of its own.

Cycles of one motion differ by chance alone if nothing changes between them; no effect of the library makes them differ,
but for those of temperature. Where they differ by more, and with faults of each cycle they do not, these are no flaw.
What all cycles leave alike is looked into beside them; faults of each have taken what they could of it, so they are
found anew beside every effect. Where the temperature changes too, shorts that grow alike in all phases as the winding
warms are left to a magnet that does so; what else grows is none of the temperature's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import block_diag

from ema.core.names import FAULTS
from ema.core.records import Array
from ema.discrepancy.actuator.simulating.noise import scatter
from ema.discrepancy.plant import Point
from ema.effects import registry

from .candidates import WARMER
from .fit import (
    N_SEEDS,
    Columns,
    Fit,
    bounds,
    columns,
    fit,
    residuals,
    solve_within_bounds,
    stacked_jacobian,
    step_to,
)
from .free import K_FREE, Free, free
from .model import Model

if TYPE_CHECKING:
    from .search import Search

DIFFER = 1.5  # times what noise makes of the differences between cycles of one motion
TOLD = 0.01  # range of a fault from which it is said to change
SURELY = 3.0  # deviations from nothing of what is said to go with the temperature
FLUX, FLUX_STEP = "magnet_flux", 0.03
CHANGE, PER_KELVIN = f"{FLUX}.change", f"{FLUX}.per_kelvin"


def is_steady(search: Search, model: Model) -> bool:
    """Whether cycles of one motion differ by chance alone."""
    cycles = range(search.plant.data.n_cycles)
    return _differ(search, residuals(search.plant, search.noise, model.fit.point, cycles, N_SEEDS)) < DIFFER


def find_growing_faults(search: Search, model: Model) -> Array | None:
    """Faults of each cycle, shape (n_cycles, 6), if these explain what cycles of one motion differ by."""
    if is_steady(search, model):
        return None
    search.say("cycles of one motion differ: faults of each")
    cycles = range(search.plant.data.n_cycles)
    fits = _fit_each_cycle(search, model.fit)
    left = {c: fitted.residuals[c] for c, fitted in zip(cycles, fits, strict=True)}
    faults = _faults(search, fits)
    if _differ(search, left) >= DIFFER or _range_within(search, faults) < TOLD:
        return None
    return faults


def _range_within(search: Search, faults: Array) -> float:
    """The largest range of a fault between cycles of one motion; where motions alone differ, nothing grows."""
    motion = search.plant.data.motion
    return float(max(np.ptp(faults[motion == m], axis=0).max() for m in range(search.plant.n_motions)))


def find_faults_beside(search: Search, model: Model) -> tuple[Array, Point]:
    """Faults of each cycle, shape (n_cycles, 6), and the point of the effects of `model` beside them.

    Held-out cycles have faults of their own beside what training cycles say of the effects.
    """
    point = _step_together(search, model.fit, _fit_each_cycle(search, model.fit))
    moved = replace(model.fit, point={**model.fit.point, **point})
    return _faults(search, [_fit_one_cycle(search, moved, c) for c in range(search.plant.data.n_cycles)]), moved.point


def _is_warming(search: Search) -> bool:
    return bool(np.ptp(search.plant.data.dT) > WARMER)


def _fit_each_cycle(search: Search, of_all: Fit) -> list[Fit]:
    """Faults of each cycle; where it becomes warmer, beside a magnet that goes with that."""
    fits = [_fit_one_cycle(search, of_all, c) for c in range(search.plant.data.n_cycles)]
    more = _flux_per_kelvin(search, of_all, fits) if _is_warming(search) else 0.0
    if not more:
        return fits
    per_kelvin = of_all.point.get(PER_KELVIN, 0.0) + more
    search.say(f"beside a magnet that changes by {per_kelvin:.2%} per kelvin: faults of each anew")
    warmer = replace(of_all, point={**of_all.point, PER_KELVIN: per_kelvin})
    return [_fit_one_cycle(search, warmer, c) for c in range(search.plant.data.n_cycles)]


def _step_together(search: Search, of_all: Fit, fits: Sequence[Fit]) -> Point:
    """Parameters of the effects after a Gauss–Newton step with faults of each training cycle.

    Found in turn they creep: a magnet that weakens with the temperature and a short that grows with it are nearly one.
    """
    own = [f for f in of_all.free if f.name not in FAULTS]
    if not own:
        return {}
    start = fits[0].point
    cols = columns(search.plant, own, start, range(search.plant.n_motions))
    parts: list[Array] = []
    for c in search.train:
        J = [stacked_jacobian(search.noise, own, cols, [c])]
        J += [stacked_jacobian(search.noise, fits[c].free, fits[c].columns, [c])]
        # All that a cycle says of its parameters is in the triangle of its QR decomposition.
        parts.append(np.asarray(np.linalg.qr(np.column_stack([*J, fits[c].residuals[c]]), mode="r")))
    n = len(own)
    A = np.column_stack([np.concatenate([R[:, :n] for R in parts]), block_diag(*(R[:, n:-1] for R in parts))])
    ends = [bounds(own, start), *(bounds(fits[c].free, fits[c].point) for c in search.train)]
    low, high = (np.concatenate([end[side] for end in ends]) for side in (0, 1))
    step, _ = solve_within_bounds(A, np.concatenate([R[:, -1] for R in parts]), low, high)
    moved = step_to(start, own, step[:n])
    return {f.name: moved[f.name] for f in own}


def _fit_one_cycle(search: Search, of_all: Fit, cycle: int) -> Fit:
    """Faults of one cycle, with the columns of its motion."""
    data = search.plant.data
    known = {key: column for key, column in of_all.columns.items() if key[0] == data.motion[cycle]}
    return _one(search, _free_faults(search, cycle), of_all.point, cycle, known)


def _free_faults(search: Search, cycle: int) -> list[Free]:
    """Faults of one cycle beyond its own: with these none is less than nothing."""
    own = search.plant.data.faults[cycle].tolist()
    return [replace(f, low=f.low - x, high=f.high - x) for f, x in zip(K_FREE, own, strict=True)]


def _one(search: Search, frees: Sequence[Free], start: Point, cycle: int, known: Columns | None = None) -> Fit:
    return fit(search.plant, search.noise, frees, start, [cycle], known=known, n_iterations=5)


def _flux_per_kelvin(search: Search, of_all: Fit, fits: Sequence[Fit]) -> float:
    """By how much a magnet changes per kelvin in place of what the shorts of each cycle have in common; zero if unsure.

    One cycle does not tell a weaker magnet from shorts of all phases, so the phase with the least has none here.
    """
    shorts = _shorts()
    own = search.plant.data.faults[:, [FAULTS.index(name) for name in shorts]]
    k = own + np.array([[fitted.point[name] for name in shorts] for fitted in fits])
    least = shorts[int(np.argmin(k.mean(axis=0)))]
    change, sd = np.empty(len(fits)), np.empty(len(fits))
    for c, fitted in enumerate(fits):
        common = float(k[c].min())
        without = dict(zip(shorts, (k[c] - common - own[c]).tolist(), strict=True))
        without[least] = -float(own[c, shorts.index(least)])
        frees = [*(f for f in _free_faults(search, c) if f.name != least), free(CHANGE, FLUX_STEP)]
        flux = of_all.point.get(CHANGE, 0.0) - common
        instead = _one(search, frees, {**fitted.point, **without, CHANGE: flux}, c)
        change[c], sd[c] = instead.point[CHANGE], instead.sd[CHANGE]
    dT = search.plant.data.dT
    line, covariance = np.polyfit(dT, change, 1, w=1.0 / sd, cov="unscaled")
    chi2 = float((((change - np.polyval(line, dT)) / sd) ** 2).sum()) / max(len(fits) - 2, 1)
    slope, slope_sd = float(line[0]), float(np.sqrt(max(chi2, 1.0) * covariance[0, 0]))
    needed = max(SURELY * slope_sd, 0.0 if PER_KELVIN in of_all.point else TOLD / np.ptp(dT))
    return slope if len(fits) > 2 and abs(slope) > needed else 0.0


def _faults(search: Search, fits: Sequence[Fit]) -> Array:
    return np.array([_beyond(own, of.point) for own, of in zip(search.plant.data.faults, fits, strict=True)])


def deviations(search: Search, model: Model) -> dict[str, float]:
    """Deviations of the effects of `model` that know of faults which are free in every cycle, where they are seen.

    Faults are never negative, so what noise makes of those that are not there does not vanish in the mean: what shorts
    of all phases have in common in a cycle is missing in the magnet.
    """
    data, noise, of_all = search.plant.data, search.noise, model.fit
    own = [f for f in of_all.free if f.name not in FAULTS]
    k = _beyond(data.faults, of_all.point)
    cycles = sorted(search.train)
    parts = []
    for c in cycles:
        seen = [f for f, x in zip(K_FREE, k[c], strict=True) if x > TOLD and (data.motion[c], f.name) in of_all.columns]
        J = stacked_jacobian(noise, own, of_all.columns, [c])
        if seen:  # what the cycle's own faults cannot do
            J_k = stacked_jacobian(noise, seen, of_all.columns, [c])
            J = J - J_k @ np.linalg.lstsq(J_k, J, rcond=None)[0]
        parts.append(J)
    stacked = np.concatenate(parts)
    solution = np.split(np.linalg.pinv(stacked), np.cumsum([len(x) for x in parts])[:-1], axis=1)
    sd = np.sqrt(np.diag((1.0 + 1.0 / N_SEEDS) * max(of_all.misfit, 1.0) * scatter(noise, solution, cycles)))
    wider = {f.name: max(float(x), of_all.sd[f.name]) for f, x in zip(own, sd, strict=True)}
    if PER_KELVIN in wider:
        common = k[:, [FAULTS.index(name) for name in _shorts()]].min(axis=1)
        wider[PER_KELVIN] = float(np.hypot(wider[PER_KELVIN], common.max() / np.ptp(data.dT)))
    return wider


def _shorts() -> list[str]:
    return [name for name in registry()[FLUX].mistaken_for if name in FAULTS]


def _beyond(faults: Array, point: Point) -> Array:
    """Faults beyond those of a point, (6,) or one row for each cycle, as wholes."""
    return np.clip(faults + [point.get(name, 0.0) for name in FAULTS], 0.0, 1.0)


def describe(faults: Array, point: Point) -> str:
    """The sentence for faults of each cycle, shape (n_cycles, 6), beyond those of a point."""
    k = _beyond(faults, point)
    ranges = [
        f"{name} {low:.3f} to {high:.3f}"
        for name, low, high in zip(FAULTS, k.min(axis=0), k.max(axis=0), strict=True)
        if high - low > TOLD
    ]
    return f"faults change from cycle to cycle: {', '.join(ranges)}; what is told of them here is their mean"


def _differ(search: Search, left: Mapping[int, Array]) -> float:
    """Squared differences between cycles of one motion, over what noise makes of them; one where none is repeated."""
    found = expected = 0.0
    for motion in range(search.plant.n_motions):
        cycles: Sequence[int] = np.flatnonzero(search.plant.data.motion == motion).tolist()
        r = np.array([left[c] for c in cycles])
        found += float(((r - r.mean(axis=0)) ** 2).sum())
        each = search.noise.expected(cycles[:1]) * (1.0 + 1.0 / N_SEEDS)
        expected += (len(cycles) - 1) * each
    return found / expected if expected else 1.0
