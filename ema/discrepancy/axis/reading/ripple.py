"""Speed ripple under a constant voltage: it tells no torque, but orders per turn at which the speed varies.

    δω_n = τ_n / (J i n ω + C + k_t k_e / R)     by a torque locked to the rotor
    δω_n = i n ω ε_n                              by an encoder that errs by ε_n

At one speed one is as good as the other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.signal import savgol_filter

from ema.core.records import Array, Cycle

if TYPE_CHECKING:
    from .measured import Measured

STEADY = 0.05  # of the speed, that it may leave its median by
TURNS = 6.0  # in steady motion, at least: two halves of three
SHOWN = 0.8  # of half the sampling rate, up to which a line is looked for
ALARM = 1e-3  # of a line that is not there, over all orders
AGREE = 0.3  # of a line, by which both halves of the record may differ
MOST = 4  # lines that are told


@dataclass(frozen=True)
class Ripple:
    """A line of the speed: its order per turn, its amplitude [rad/s] at the mean speed [rad/s]."""

    order: int
    amplitude: float
    speed: float


def find_ripples(cycle: Cycle) -> list[Ripple]:
    """Lines of a cycle's steady speed that both its halves show, the strongest first."""
    theta, w = np.unwrap(cycle["theta_m"]), cycle["w_m"]
    median = float(np.median(w))
    smooth = savgol_filter(w, min(11, len(w) // 2 * 2 - 1), 1) if len(w) > 11 else w
    away = np.flatnonzero(np.abs(smooth - median) > STEADY * abs(median))
    edges = np.concatenate(([-1], away, [len(w)]))
    k = int(np.argmax(np.diff(edges)))
    steady = slice(edges[k] + 1, edges[k + 1])
    theta, w = theta[steady], w[steady]
    if len(w) < 100 or abs(float(theta[-1] - theta[0])) < TURNS * 2.0 * np.pi or median == 0.0:
        return []
    highest = int(SHOWN * np.pi / (cycle.period * abs(median)))
    if highest < 2:
        return []
    half = len(w) // 2
    whole, first, second = (_lines(theta[s], w[s], highest) for s in (slice(None), slice(half), slice(half, None)))
    power = np.abs(whole) ** 2
    noise = float(np.median(power)) / np.log(2.0)
    shown = np.exp(-power / max(noise, 1e-300)) * highest < ALARM
    shown &= np.abs(first - second) < AGREE * np.abs(whole)
    best = sorted(np.flatnonzero(shown), key=lambda n: -power[n])[:MOST]
    return [Ripple(int(n) + 1, float(np.abs(whole[n])), abs(median)) for n in best]


def _lines(theta: Array, w: Array, highest: int) -> Array:
    """Complex amplitudes of the orders 1 … `highest`."""
    columns = [f(n * theta) for n in range(1, highest + 1) for f in (np.cos, np.sin)]
    t = np.linspace(-1.0, 1.0, len(w))
    A = np.stack([*columns, np.ones(len(w)), t, t**2], axis=1)
    x, *_ = np.linalg.lstsq(A, w, rcond=None)
    return np.asarray(x[: 2 * highest : 2] - 1j * x[1 : 2 * highest : 2])


def list_ripples(plant: Measured) -> dict[str, list[Ripple]]:
    """The lines of each record under one voltage whose speed ripples, by the record's name."""
    if plant.plant.is_linear:
        return {}
    found = {
        bench.name: [
            one
            for cycle in record
            if bench.roles.kind == "voltage" and {"theta_m", "w_m"} <= set(cycle.channels) and _is_one_voltage(cycle)
            for one in find_ripples(cycle)
        ][:MOST]
        for bench, record in zip(plant.benches, plant.records, strict=True)
    }
    return {name: lines for name, lines in found.items() if lines}


def structure(plant: Measured) -> dict[str, Any]:
    """What of it is structure of the rest: rows with the two readings of each line, and a sentence a record."""
    found = list_ripples(plant)
    rows = [_row(plant, name, one) for name, lines in found.items() for one in lines]
    orders = {name: ", ".join(f"{one.order}" for one in lines) for name, lines in found.items()}
    said = [f"{name}: the speed ripples at orders {orders[name]} per turn" for name in found]
    return {"ripple": rows, "sentences": said} if rows else {}


def describe(plant: Measured) -> Iterator[str]:
    """A sentence for each record, with what may make the lines and what would tell."""
    for name, lines in list_ripples(plant).items():
        yield (
            f"{name}: at {lines[0].speed:.4g} rad/s the speed ripples: "
            f"{'; '.join(_said(_row(plant, name, one)) for one in lines)}; each may also be a "
            "back-EMF that is no sine, and one speed under one voltage does not tell which: record several "
            "constant voltages (a torque keeps its size in N m, an encoder's error in rad, what a back-EMF makes "
            "grows with the speed) and the phase currents"
        )


def _is_one_voltage(cycle: Cycle) -> bool:
    """Whether the voltage stays what it is once it is on."""
    return len(np.unique(cycle["u_q"][cycle["u_q"] != 0.0])) == 1


def _row(plant: Measured, record: str, one: Ripple) -> dict[str, Any]:
    """A line, the torque [N m] and the encoder's error [rad] that would make it."""
    p, n = plant.plant, one.order
    braking = float(p.k_t or 0.0) * float(p.k_e or 0.0) / float(p.R) if p.R else 0.0
    return {
        "record": record,
        **asdict(one),
        "torque": abs(p.inertia * 1j * n * one.speed + p.C + braking) * one.amplitude,
        "encoder": one.amplitude / (n * one.speed),
    }


def _said(row: dict[str, Any]) -> str:
    return (
        f"order {row['order']} by {row['amplitude']:.3g} rad/s, as by a torque of {row['torque']:.3g} N m at "
        f"the plant file's inertia (cogging) or an encoder that errs by {row['encoder']:.2g} rad"
    )
