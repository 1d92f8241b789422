"""Prognosis on simulated growth histories: does the interval hold what it promises, and when is nothing told?

python -m benchmarks.prognosis [N [N_PROGPY]]
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from ema_postflight.prognosis import Prognosis, Trend, prognosis

SEED = 21
THRESHOLD = 0.3
LIFE = 1e6  # from the beginning of a history to the crossing [s]
FAMILIES = ("linear", "exponential", "power", "Paris", "gamma process", "two slopes")
NEVER = ("healthy", "settling")
Method = Callable[[Trend, float, np.random.Generator], Prognosis]


class History(NamedTuple):
    """Estimates until now, and the true remaining life [s]."""

    family: str
    trend: Trend
    life: float


def histories(count: int, seed: int, families: tuple[str, ...] = FAMILIES) -> Iterator[History]:
    """Histories of growing faults, seen until somewhere between 40 and 95 % of their life."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, 4001)
    for number in range(count):
        family = families[number % len(families)]
        onset, k_0 = rng.uniform(0.0, 0.3), rng.uniform(0.0, 0.03)
        if family in NEVER:
            limit = rng.uniform(0.05, 0.2) if family == "settling" else 0.0
            k, now = k_0 + limit * -np.expm1(-t / rng.uniform(0.1, 0.25)), 1.0
        else:
            s = np.maximum(t - onset, 0.0) / (1.0 - onset)
            k, now = k_0 + (THRESHOLD - k_0) * _growth(family, s, rng), rng.uniform(0.4, 0.95)
        n, sd = int(rng.choice([20, 60, 200, 1000])), float(rng.choice([0.004, 0.01, 0.02]))
        seen = np.sort(rng.uniform(0.0, now, n))
        k_hat = np.clip(np.interp(seen, t, k) + sd * rng.standard_normal(n), 0.0, 1.0)
        life = (1.0 - seen[-1]) * LIFE if family not in NEVER else np.inf
        yield History(family, Trend(seen * LIFE, k_hat, np.full(n, sd)), life)


def _growth(family: str, s: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """From 0 at s = 0 to 1 at s = 1."""
    if family == "linear":
        return s
    if family == "exponential":
        rate = rng.uniform(1.0, 5.0)
        return np.expm1(rate * s) / np.expm1(rate)
    if family == "power":
        return s ** rng.uniform(0.5, 3.0)
    if family == "Paris":  # dk/dt = C k^m from 8 % of the threshold
        m, k_0 = rng.uniform(1.2, 2.5), 0.08
        k = (k_0 ** (1.0 - m) - (k_0 ** (1.0 - m) - 1.0) * s) ** (1.0 / (1.0 - m))
        return (k - k_0) / (1.0 - k_0)
    if family == "gamma process":
        steps = rng.gamma(np.diff(s, prepend=0.0) * rng.uniform(30.0, 100.0) + 1e-12)
        return np.cumsum(steps) / steps.sum()
    bend, ratio = rng.uniform(0.2, 0.8), rng.uniform(0.3, 3.0)
    k = np.where(s < bend, s, bend + ratio * (s - bend))
    return k / k[-1]


class Told(NamedTuple):
    """One history, and what was told of it."""

    history: History
    prognosis: Prognosis

    @property
    def level(self) -> float:
        """Share of the draws below the true remaining life: uniform if the prognosis is calibrated."""
        return float(np.mean(self.prognosis.draws <= self.history.life))


def run(
    count: int, seed: int, families: tuple[str, ...] = FAMILIES, method: Method = prognosis
) -> tuple[list[Told], float]:
    """The prognosis of every history, and the CPU time of one [ms]."""
    rng = np.random.default_rng(seed + 1)
    made = list(histories(count, seed, families))
    began = time.process_time()
    told = [Told(h, method(h.trend, THRESHOLD, rng)) for h in made]
    return told, 1e3 * (time.process_time() - began) / count


def coverage(told: list[Told], share: float) -> float:
    """Share of histories told of whose true life is in the central interval of `share`."""
    levels = np.array([one.level for one in told if not one.prognosis.silent])
    return float(np.mean(np.abs(levels - 0.5) <= share / 2))


def scores(count: int, method: Method = prognosis) -> dict[str, tuple[float, float | None, str]]:
    """Figures of one method on `count` histories that grow and a third as many that never fail: value, ideal, unit."""
    told, ms = run(count, SEED, method=method)
    never, _ = run(count // 3, SEED, NEVER, method)
    spoken = [one for one in told if not one.prognosis.silent]
    error = [abs(one.prognosis.life[1] / one.history.life - 1.0) for one in spoken]
    width = [(one.prognosis.life[2] - one.prognosis.life[0]) / one.history.life for one in spoken]
    families = {
        f"  coverage of the 90 % interval, {family}": (
            coverage([one for one in told if one.history.family == family], 0.9), 0.9, "1",
        )
        for family in FAMILIES
    }  # fmt: skip
    return {
        "coverage of the 50 % interval": (coverage(told, 0.5), 0.5, "1"),
        "coverage of the 90 % interval": (coverage(told, 0.9), 0.9, "1"),
        **families,
        "growing faults told of": (len(spoken) / count, None, "1"),
        "faults that never fail told of": (float(np.mean([not o.prognosis.silent for o in never])), 0.0, "1"),
        "median error of the median life": (float(np.median(error)), None, "1"),
        "median width of the 90 % interval in lives": (float(np.median(width)), None, "1"),
        "time": (ms, None, "ms of CPU"),
    }


def rows(count: int = 600, n_peer: int = 120) -> list[dict[str, Any]]:
    """The bench's table: all histories, then the first `n_peer` of them beside ProgPy, if it is installed."""
    found = [_row(f"prognosis: {figure}", *score) for figure, score in scores(count).items()]
    try:
        from . import _progpy
    except ImportError:
        return [*found, _row("prognosis beside ProgPy: needs pip install 'ema-monitor[bench-peers]'", np.nan, None, "")]
    own, peer = scores(n_peer), scores(n_peer, _progpy.prognosis)
    return found + [
        _row(f"prognosis, {n_peer} of them: {figure.strip()}", *own[figure])
        | {"peer": "ProgPy", "peer_value": round(peer[figure][0], 3)}
        for figure in own
    ]


def _row(figure: str, value: float, ideal: float | None, unit: str) -> dict[str, Any]:
    return {"figure": figure, "value": round(value, 3), "unit": unit, "limit": ideal, "seed": SEED}


if __name__ == "__main__":
    for row in rows(*(int(text) for text in sys.argv[1:3])):
        limit = "" if row["limit"] is None else f"   (ideal {row['limit']})"
        peer = f"   {row['peer']} {row['peer_value']:.3f}" if "peer" in row else ""
        print(f"{row['figure']:<80} {row['value']:8.3f} {row['unit']}{limit}{peer}")
