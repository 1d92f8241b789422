"""Laws of a warm, geared, compliant axis hidden one at a time in drawn benches, and what the balance names.

python -m benchmarks.laws_axis [--trials N] [--log FILE] [--seed N]

The balance alone, not free runs: seconds for each trial. Sizes are drawn so that the law takes a share of the torque
that a test engineer would ask about; the simulation (tests/support/geared.py) shares no code with the library. Each
answer is appended to the log as one line of JSON; a log is continued, and printed alone with --trials 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import geared
import numpy as np

from benchmarks import resumed
from ema.core.version import version
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import RotaryAxis

SURE = 0.9
GEAR = {"gear": 6.0, "gear_kind": "planetary", "teeth": (17, 85)}
MESH = 17.0 * 85.0 / 102.0
Hide = Callable[[geared.Axis, np.random.Generator], geared.Axis]


def _warm(rng: np.random.Generator) -> tuple[float, float, float]:
    return 20.0, 20.0 + rng.uniform(20.0, 45.0), rng.uniform(1.5, 5.0)


HIDDEN: dict[str, Hide] = {
    "nothing": lambda a, rng: replace(a, warms=_warm(rng)),
    "friction_memory": lambda a, rng: replace(a, bristle=10.0 ** rng.uniform(-1.7, -0.4)),
    "friction_by_temperature": lambda a, rng: replace(a, dry_per_kelvin=rng.uniform(0.005, 0.02), warms=_warm(rng)),
    "viscous_by_temperature": lambda a, rng: replace(
        a, C=rng.uniform(0.8e-3, 2e-3), viscous_activation=rng.uniform(2000.0, 5000.0), warms=_warm(rng)
    ),
    "friction_drift": lambda a, rng: replace(a, dry_rate=rng.choice([-1.0, 1.0]) * rng.uniform(0.02, 0.06)),
    "viscous_drift": lambda a, rng: replace(
        a, C=rng.uniform(0.8e-3, 2e-3), viscous_rate=rng.choice([-1.0, 1.0]) * rng.uniform(0.03, 0.06)
    ),
    "magnet_flux": lambda a, rng: replace(
        a, flux_per_kelvin=-rng.uniform(0.0008, 0.0015), warms=(20.0, rng.uniform(80.0, 120.0), rng.uniform(1.5, 5.0))
    ),
    "quadratic_load_friction": lambda a, rng: replace(a, by_square=rng.uniform(1.0, 2.5)),
    "gear_error": lambda a, rng: replace(a, lines=((rng.uniform(0.002, 0.01), MESH, rng.uniform(0.0, 6.0)),)),
    "cogging": lambda a, rng: replace(
        a, lines=((rng.uniform(0.002, 0.01), float(rng.choice([12, 14, 24])), rng.uniform(0.0, 6.0)),)
    ),
}


def look(seed: int, number: int) -> dict[str, Any]:
    """Hide a law in a drawn bench; what the balance says."""
    name = list(HIDDEN)[number % len(HIDDEN)]
    rng = np.random.default_rng([seed, number])
    plain = geared.Axis()
    axis = replace(plain, J=plain.J * rng.uniform(0.6, 1.6), F=plain.F * rng.uniform(0.6, 1.6))
    axis = HIDDEN[name](axis, rng)
    has_sensor = "temperature" in name or name in ("nothing", "friction_memory", "magnet_flux")
    record = geared.record(axis, number, seconds=10.0, size=rng.uniform(0.6, 1.4), temperature=has_sensor)
    plant = AxisPlant(RotaryAxis.model_validate(geared.plant(axis, **GEAR)), [record], n_threads=1)
    plant.between = "held"
    assert plant.balance is not None
    b = plant.balance
    said = [[t.law.name, round(b.of_set(t), 4), sorted({*t.alike, *t.law.also})] for t in b.terms]
    return {"code": version(), "seed": seed, "number": number, "hidden": name, "said": said}


def rated(row: dict[str, Any]) -> str:
    """What an answer counts as: the truth alone, in a set of two, with less than `SURE`, beside another, or not.

    How sure is said of the law and those it is not told from together.
    """
    sets = [({name, *others}, sure) for name, sure, others in row["said"]]
    own = [(s, sure) for s, sure in sets if row["hidden"] in s]
    wrong = any(row["hidden"] not in s and sure >= SURE for s, sure in sets)
    if row["hidden"] == "nothing":
        return "wrong" if wrong else "silent"
    if wrong:
        return "another named too" if own else "wrong"
    if not own:
        return "missed"
    s, sure = own[0]
    if len(s) > 2:
        return "in a larger set"
    return "perhaps" if sure < SURE else "named" if len(s) == 1 else "in a set of two"


def table_of(rows: list[dict[str, Any]]) -> str:
    """By hidden law."""
    kinds = ["silent", "named", "in a set of two", "perhaps", "in a larger set", "missed", "another named too", "wrong"]
    lines = [f"| hidden | trials | {' | '.join(kinds)} |", "|---" * (len(kinds) + 2) + "|"]
    for name in HIDDEN:
        own = [rated(row) for row in rows if row["hidden"] == name]
        lines.append(f"| {name} | {len(own)} | " + " | ".join(str(own.count(kind) or "") for kind in kinds) + " |")
    return "\n".join([*lines, "", f"commit {', '.join(sorted({row['code'] for row in rows}))}"])


def main() -> None:
    """Run what is missing, and print."""
    resumed.run(
        __doc__, "var/laws_axis.jsonl", 10 * len(HIDDEN), look,
        lambda row: f"{row['hidden']} {rated(row)} {row['said']}", table_of,
    )  # fmt: skip


if __name__ == "__main__":
    main()
