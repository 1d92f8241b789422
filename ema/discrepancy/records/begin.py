"""The first plant file of a record: what a data sheet says, what the record shows, what is only a guess; each marked.

    τ = J dω/dt + C ω + F_d sgn ω + τ₀        τ = k_t i_q, or the measured torque
    F = M dv/dt + C v + F_d sgn v + F₀

fitted by least squares to derivatives over some samples: good enough to begin a search, and marked as that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ema.core.errors import RecordError
from ema.core.names import CHANNELS, CURRENTS
from ema.core.records import Record

from .agreements import OVER, agreements, derivative, smooth

SLOW = 0.02  # of the highest speed; below, friction's sign is not known
POLE_PAIRS = range(1, 31)
COHERENT = 0.5  # share of the currents' vector that turns with the rotor, from which pole pairs can be told


@dataclass(frozen=True)
class Known:
    """A parameter of the plant file: its value as text with unit, and where it is from."""

    key: str
    value: str
    origin: str


@dataclass(frozen=True)
class Sheet:
    """What a data sheet says; None where it does not. Units: rpm/V, ohm (phase), H (phase), kg m², N m/A."""

    pole_pairs: int | None = None
    gear: float | None = None
    R: float | None = None
    L: float | None = None
    KV: float | None = None
    k_t: float | None = None
    J: float | None = None


def axis(records: Sequence[Record], sheet: Sheet) -> list[Known]:
    """Parameters of an axis from its records; RecordError where they hold no motion or no drive."""
    have = set.intersection(*(set(record.channels) for record in records))
    there = ", ".join(sorted(have))
    linear = not have & {"theta_m", "w_m"} and bool(have & {"q", "v"})
    position, speed = ("q", "v") if linear else ("theta_m", "w_m")
    if not have & {position, speed}:
        raise RecordError(f"{records[0].name}: no motion: theta_m, w_m, q or v is wanted (has {there})")
    drive = next((name for name in ("force", "torque", "i_q", "u_q") if name in have), None)
    if drive is None:
        raise RecordError(f"{records[0].name}: no drive: i_q, torque, force or u_q is wanted (has {there})")
    known = [Known("kind", "axis", "")] + ([Known("motion", "linear", "")] if linear else [])
    known.append(Known("drive", {"i_q": "current", "u_q": "voltage"}.get(drive, drive), f"by the channel {drive}"))
    k_t, k_e, whence = _constants(sheet)
    if drive in ("i_q", "u_q"):
        known += [Known("k_t", _number(k_t, "N/A" if linear else "N m/A"), whence)]
    if "u_q" in have:
        known += [Known("k_e", _number(k_e, "V s/m" if linear else "V s/rad"), whence)]
    for key, unit, value in (("R", "ohm", sheet.R), ("L", "H", sheet.L)):
        if value is not None:
            known.append(Known(key, _number(value, unit), "data sheet"))
        elif key == "R" and drive == "u_q":
            known.append(Known(key, "1 ohm", "a guess: give --R"))
    mass, unit = ("M", "kg") if linear else ("J", "kg m^2")
    scale = {"i_q": k_t}.get(drive, 1.0)
    fit = None if drive == "u_q" else _balance(records, position, speed, drive, scale)
    if fit is None:
        inertia, C, F_d, origin = sheet.J or 1e-4, 0.0, 1e-3, "a guess: fitted where the search begins"
    else:
        (inertia, C, F_d), origin = fit, "fitted to the records, a start"
    if sheet.J is not None:
        known.append(Known(mass, _number(sheet.J, unit), "data sheet"))
    else:
        known.append(Known(mass, _number(max(inertia, 1e-9), unit), origin))
    known.append(Known("C", _number(max(C, 0.0), "N s/m" if linear else "N m s/rad"), origin))
    known.append(Known("F_d", _number(max(F_d, 0.0), "N" if linear else "N m"), origin))
    if sheet.pole_pairs and not linear:
        known.append(Known("p", str(sheet.pole_pairs), "data sheet"))
    fitted = f"[{mass}]" if sheet.J is None else "[]"
    known.append(Known("fitted", fitted, "what `ema discrepancy` fits in every model"))
    return known


def pole_pairs(record: Record) -> int | None:
    """Pole pairs by which the phase currents turn with the rotor; None where they do not tell."""
    if not {*CURRENTS, "theta_m"} <= set(record.channels):
        return None
    turn = np.exp(2j * np.pi / 3.0 * np.arange(3))
    s = np.concatenate([turn @ np.stack([cycle[name] for name in CURRENTS]) for cycle in record.cycles])
    theta_m = np.concatenate([cycle["theta_m"] for cycle in record.cycles])
    # The square does not know the torque's sign.
    share = [abs(np.sum(s**2 * np.exp(-2j * p * theta_m))) / max(np.sum(np.abs(s) ** 2), 1e-300) for p in POLE_PAIRS]
    best = int(np.argmax(share))
    return POLE_PAIRS[best] if share[best] > COHERENT else None


def gear_ratio(record: Record) -> float | None:
    """Turns of the motor for one of the user; None where there is no such pair of channels."""
    return next((one.slope for one in agreements(record) if one.what == "theta_m against theta_u"), None)


def back_emf(KV: float) -> float:
    """k_e of one phase [V s/rad] from KV [rpm/V], which is of the line-to-line voltage."""
    return float(60.0 / (2.0 * np.pi * KV * np.sqrt(3.0)))


def _constants(sheet: Sheet) -> tuple[float, float, str]:
    """k_t, k_e and where they are from: KV is of the line-to-line voltage, currents are amplitude-invariant."""
    if sheet.k_t is not None:
        return sheet.k_t, sheet.k_t / 1.5, "data sheet"
    if sheet.KV is not None:
        k_e = back_emf(sheet.KV)
        return 1.5 * k_e, k_e, f"KV {sheet.KV:g} rpm/V: k_e = 60 / (2 pi KV sqrt 3), k_t = 3/2 k_e"
    return 1.0, 1.0, "a guess: give --kv or --k-t; until then inertia and friction are in units of the current"


def _balance(
    records: Sequence[Record], position: str, speed: str, drive: str, scale: float
) -> tuple[float, float, float] | None:
    """Inertia, viscous and sliding friction by least squares; None where nothing moves."""
    rows, rhs = [], []
    for cycle in (cycle for record in records for cycle in record.cycles if cycle.n_samples > 8 * OVER):
        w = smooth(cycle[speed]) if speed in cycle else derivative(cycle, position)
        a, tau = derivative(cycle, w), scale * smooth(cycle[drive])
        inside = slice(2 * OVER, -2 * OVER)
        rows.append(np.stack([a, w, np.sign(w), np.ones_like(w)], axis=1)[inside])
        rhs.append(tau[inside])
    if not rows:
        return None
    A, b = np.concatenate(rows), np.concatenate(rhs)
    moving = np.abs(A[:, 1]) > SLOW * np.abs(A[:, 1]).max()
    if moving.sum() < 50:
        return None
    size = np.maximum(np.linalg.norm(A[moving], axis=0), 1e-300)
    x, *_ = np.linalg.lstsq(A[moving] / size, b[moving], rcond=1e-9)
    inertia, C, F_d, _ = (float(value) for value in x / size)
    return inertia, C, F_d


def _number(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}"


def channels_said(records: Sequence[Record]) -> str:
    """Channels of the records with their units, for a comment."""
    names = sorted(set.union(*(set(record.channels) for record in records)))
    return ", ".join(f"{name} [{CHANNELS[name].unit}]" for name in names)
