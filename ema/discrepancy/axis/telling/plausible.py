"""Nominal values that no machine has, with what would make them: of the plant file, as fitted, as recorded.

Where voltage, current and motion were recorded, resistance and back-EMF are seen without any simulation:

    u_q = R i_q + L di_q/dt + k_e ω
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ema.core.records import Array, Cycle
from ema.discrepancy.axis.naming.linear import in_metres
from ema.discrepancy.axis.reading.smooth import local_polynomial
from ema.discrepancy.findings import WITHIN
from ema.discrepancy.outcome import Outcome

if TYPE_CHECKING:
    from ema.discrepancy.axis.finding.plant import AxisPlant

FACTOR = 3.0  # of the plant file, from which a fitted value is another machine's
RATIOS = (1.0, 1.5)  # k_t / k_e: of a machine for direct current, and of three phases with amplitudes of phase values
LOSSLESS = 0.03  # of k_t, that the data sheets of both may disagree by
DISAGREE = 0.2  # of k_e, beyond which the record contradicts the plant file's (KV)
N_BLOCKS, FEWEST = 24, 240
N_HALF = 5  # samples to each side, over which the speed and the current's slope are taken
CLEAR = 3.0  # deviations
NOISY = 0.05  # share of the current's power beside the speed that may be noise: by so much R is too small
MADE_BY = {
    "R": "a voltage that is commanded and not measured, an inverter's drop, or a duty taken for another supply",
    "L": "a current or voltage that is filtered or late",
    "J": "a load on the axis, a gear ratio that is missing, or a drive's torque in another unit",
    "M": "a load on the axis, or a drive's force in another unit",
    "C": "friction that changes with speed, or a back-EMF constant that is wrong",
    "k_t": "a current of another amplitude (rms, line), or friction that grows with load",
    "k_e": "a voltage of another amplitude (line to line, duty), or a speed in another unit",
    "F_d": "drag in its place, or a load that follows the motion",
}


@dataclass(frozen=True)
class Electrical:
    """Resistance and back-EMF as recorded, with deviations by blocks; nan where the record does not show one."""

    R: float
    k_e: float
    R_error: float
    k_e_error: float


def find_implausible(plant: AxisPlant, outcome: Outcome) -> list[str]:
    """One sentence for each value that cannot be."""
    p = plant.plant
    out = [*_of_power(plant), *_fitted(plant, outcome)]
    seen = electrical(plant)
    if seen is None or p.R is None or p.k_e is None:
        return out
    unit = in_metres("V s/rad") if p.is_linear else "V s/rad"
    if float(p.R) / FACTOR > seen.R and float(p.R) - seen.R > CLEAR * seen.R_error:
        out.append(f"the record shows R = {seen.R:.3g} ohm, the plant file says {p.R:.3g}: it may be {MADE_BY['R']}")
    if float(p.R) * FACTOR < seen.R and seen.R - float(p.R) > CLEAR * seen.R_error:
        out.append(f"the record shows R = {seen.R:.3g} ohm, the plant file says {p.R:.3g}: cables, or {MADE_BY['R']}")
    if abs(seen.k_e - p.k_e) > max(DISAGREE * p.k_e, CLEAR * seen.k_e_error):
        text = f"the record shows k_e = {seen.k_e:.3g} {unit}, the plant file says {p.k_e:.3g}"
        out.append(f"{text} ({p.k_e / seen.k_e:.3g} times): it may be {MADE_BY['k_e']}")
    return out


def _of_power(plant: AxisPlant) -> list[str]:
    """A machine gives no more than it takes: k_t ω i ≤ 3/2 k_e ω i, and little less."""
    p = plant.plant
    if p.is_force or p.k_t is None or p.k_e is None:
        return []
    ratio = p.k_t / p.k_e
    if ratio > max(RATIOS) * (1.0 + LOSSLESS):
        share = ratio / max(RATIOS)
        return [f"k_t / k_e = {ratio:.3g}: an efficiency of {share:.3g}, above 1: k_t may be of {MADE_BY['k_t']}"]
    if not any(abs(ratio - r) <= 2.0 * LOSSLESS * r for r in RATIOS):
        return [
            f"k_t / k_e = {ratio:.3g}, where KV gives 1 (direct current) or 1.5 (three phases): one is of another kind"
        ]
    return []


def _fitted(plant: AxisPlant, outcome: Outcome) -> list[str]:
    p, out = plant.plant, []
    for f in plant.base if p.neighbour is None else ():  # free runs know nothing of a neighbour
        if f.name not in MADE_BY or f.name not in outcome.point:
            continue
        value, nominal = float(outcome.point[f.name]), float(getattr(p, f.name))
        unit = in_metres(f.unit) if p.is_linear else f.unit
        if f.name == "F_d":
            if value <= 0.0 < nominal:
                out.append(f"no dry friction was fitted at all (plant file {nominal:.3g} {unit}): {MADE_BY['F_d']}")
        elif nominal > 0.0 and not 1.0 / FACTOR < value / nominal < FACTOR:
            text = (
                f"{f.name} was fitted as {value:.3g} {unit}, {value / nominal:.2g} times the plant file's {nominal:.3g}"
            )
            out.append(f"{text}: it may be {MADE_BY[f.name]}")
    return out


def electrical(plant: AxisPlant) -> Electrical | None:
    """Resistance and back-EMF constant by least squares over all cycles with voltage, current and motion."""
    rows = [_rows(plant, c) for record in plant.records for c in record if {"u_q", "i_q"} <= set(c.channels)]
    kept = [r for r in rows if r is not None]
    if not kept:
        return None
    A, u = np.concatenate([r[0] for r in kept]), np.concatenate([r[1] for r in kept])
    size = np.linalg.norm(A, axis=0)
    if len(u) < FEWEST or not (size > 0.0).all() or np.linalg.cond(A / size) > 100.0:
        return None
    noise = max((b.noise["i_q"].sigma for b in plant.benches if "i_q" in b.noise), default=0.0)
    beside = A[:, 0] - A[:, 1:] @ np.linalg.lstsq(A[:, 1:], A[:, 0], rcond=None)[0]
    if noise**2 > NOISY * float(np.mean(beside**2)):
        return None  # what the current does beside the speed is its noise: it would take from R
    c = np.linalg.lstsq(A, u, rcond=None)[0]
    parts = np.array_split(np.arange(len(u)), N_BLOCKS)
    without = [np.linalg.lstsq(np.delete(A, k, axis=0), np.delete(u, k), rcond=None)[0] for k in parts]
    error = np.std(without, axis=0) * (N_BLOCKS - 1) ** 0.5
    return Electrical(float(c[0]), float(c[2]), float(error[0]), float(error[2]))


def _rows(plant: AxisPlant, c: Cycle) -> tuple[Array, Array] | None:
    linear = plant.plant.is_linear
    speed, position = ("v", "q") if linear else ("w_m", "theta_m")
    if c.n_samples < FEWEST or not {speed, position} & set(c.channels):
        return None
    t, i = c["t"], c["i_q"]
    w = c[speed] if speed in c else local_polynomial(t, c[position], N_HALF, 3)[1]
    return np.stack([i, local_polynomial(t, i, N_HALF, 2)[1], w], axis=1), c["u_q"]


def describe(plant: AxisPlant) -> dict[str, Any]:
    """The same for findings.json; empty where the records do not show it."""
    seen = electrical(plant)
    if seen is None:
        return {}
    pairs = (("R", seen.R, seen.R_error, "ohm"), ("k_e", seen.k_e, seen.k_e_error, "V s/rad"))
    linear = plant.plant.is_linear
    return {
        name: {"value": value, "low": value - WITHIN * error, "high": value + WITHIN * error,
               "unit": in_metres(unit) if linear else unit, "plant_file": getattr(plant.plant, name)}
        for name, value, error, unit in pairs
    }  # fmt: skip
