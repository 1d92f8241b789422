"""The model in doubt online: which cycles are marked, and the false fault alarms before and after extension.

    python -m benchmarks doubt

Flights of another program's actuator (tests/support/hidden_actuator.py), as frames, through the monitor on bundles of
the quick configuration (kept in the cache), LF2 in every cycle. An effect is found by `ema discrepancy` from six cycles
of another flight, and the bundle is built again from what it wrote. An alarm is a fault at or above the report's
threshold `watch` for three estimates in a row that is not there.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import hidden_actuator as hidden
import numpy as np
from hidden_traffic import Watched, watched

from ema.bundle import Bundle
from ema.core import config, resources
from ema.core.records import Cycle, Record
from ema.core.status import Reason
from ema.discrepancy.actuator.examine import examine
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.extended import write_extended
from ema.models.actuator import Actuator

from .identification import quick_bundle

SEED = 23
FLIGHTS, CYCLES = 12, 10  # of sound actuators, and of faulty ones
N_FOUND = 6  # cycles that the cause is found from
EFFECTS = {
    "magnet -6.6 %": {"flux": -0.066},
    "cogging 10 mN m": {"cogging": 0.01},
    "viscous drag 6e-5 N m s/rad": {"viscous": 6e-5},
}
K1 = 0.03  # of the flights with an effect


def flight(seed: int, n: int = CYCLES, **flaws: float) -> list[dict[str, np.ndarray]]:
    return hidden.cycles(hidden.Flaws(**flaws), n, seed, (hidden.chirp(),))


def rows() -> list[dict[str, Any]]:
    plain = quick_bundle()
    rng = np.random.default_rng(SEED)
    faults = [{}] * FLIGHTS, [_drawn(rng) for _ in range(FLIGHTS)]
    table = []
    for name, kinds in zip(("no fault", "one to three faults of 0…15 %"), faults, strict=True):
        flown = [watched(plain, flight(SEED + n, **k)) for n, k in enumerate(kinds)]
        table += _marked(name, flown)
        alarms = sum(len(seen.alarms(_vector(k))) for seen, k in zip(flown, kinds, strict=True))
        table.append(_row(f"{name}: false alarms, of {6 * len(flown)} faults", alarms, 0))
    for name, flaws in EFFECTS.items():
        cycles, k = flight(SEED, **flaws, k1=K1), _vector({"k1": K1})
        before, after = watched(plain, cycles), watched(_extended(flaws), cycles)
        for which, seen in (("plain bundle", before), ("extended bundle", after)):
            label, unseparable = f"{name}, {which}", [bool(e.reasons & Reason.UNSEPARABLE) for e in seen.estimates]
            table += _marked(label, [seen])
            table.append(_row(f"{label}: marked unseparable", float(np.mean(unseparable))))
            table.append(_row(f"{label}: false alarms", len(seen.alarms(k)), 0 if seen is after else None))
            table.append(_row(f"{label}: mean err_k", _err_k(seen, k)))
    return table


def _drawn(rng: np.random.Generator) -> dict[str, float]:
    which = rng.choice(6, rng.integers(1, 4), replace=False)
    return {f"k{j + 1}": float(rng.uniform(0.0, 0.15)) for j in which}


def _vector(faults: dict[str, float]) -> list[float]:
    return [faults.get(f"k{j}", 0.0) for j in range(1, 7)]


def _marked(name: str, flown: list[Watched]) -> list[dict[str, Any]]:
    doubted = np.concatenate([seen.doubted for seen in flown])
    told = sum(any(e.code == "model_in_doubt" for e in seen.events) for seen in flown)
    return [
        _row(f"{name}: cycles marked model in doubt, of {len(doubted)}", float(doubted.mean())),
        _row(f"{name}: flights with an event that names cycles, of {len(flown)}", told),
    ]


def _err_k(seen: Watched, k: list[float]) -> float:
    return float(np.mean([np.linalg.norm(e.k - k) for e in seen.estimates]) / 6**0.5)


def _extended(flaws: dict[str, float]) -> Bundle:
    """The bundle of the plant as `ema discrepancy` extends it."""
    plant_file = resources.config("actuator.yaml")
    record = Record(tuple(Cycle(n, c) for n, c in enumerate(flight(SEED + 100, N_FOUND, **flaws, k1=K1))))
    plant = config.load(plant_file, Actuator)
    findings = examine(plant, prepare(plant, [record])).findings
    with TemporaryDirectory() as folder:
        write_extended(plant_file, findings.effects, Path(folder) / "extended.yaml")
        return quick_bundle(config.load(Path(folder) / "extended.yaml", Actuator))


def _row(figure: str, value: float, limit: float | None = None) -> dict[str, Any]:
    return {"figure": figure, "value": value, "unit": "1", "limit": limit, "seed": SEED}
