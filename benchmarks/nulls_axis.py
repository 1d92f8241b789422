"""Axes with nothing hidden, through the whole of `ema discrepancy`: what is named where nothing is to be named.

python -m benchmarks.nulls_axis [--trials N] [--log FILE] [--seed N]

Three plants in turn, each drawn anew with its motion: a geared motor under cascaded loops that warms up, a table under
a cascade of position and speed, a servo with a pendulum (which its plant file has) under a position loop. What was
examined is appended to the log as one line of JSON; a log is continued, and printed alone with --trials 0.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import geared
import numpy as np
import positioner
from scipy import stats

from benchmarks import resumed
from ema.core.records import Record
from ema.core.version import version
from ema.discrepancy.axis.examine import findings
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import LinearAxis, RotaryAxis

SURE = 0.9  # confidence from which a name wakes somebody
Drawn = tuple[RotaryAxis | LinearAxis, Record]


def geared_motor(rng: np.random.Generator, seed: int) -> Drawn:
    """Of constant friction, though it warms up by up to 40 K; its gear and slots are declared."""
    axis = geared.Axis()
    axis = replace(
        axis, J=axis.J * rng.uniform(0.6, 1.6), F=axis.F * rng.uniform(0.6, 1.6), C=axis.C * rng.uniform(0.5, 4.0),
        warms=(20.0, 20.0 + rng.uniform(0.0, 40.0), rng.uniform(1.0, 5.0)),
    )  # fmt: skip
    loop = (rng.uniform(25.0, 50.0), rng.uniform(0.03, 0.08))
    record = geared.record(axis, seed, seconds=7.0, size=rng.uniform(0.5, 1.5), temperature=True, loop=loop)
    gear = {"gear": 6.0, "gear_kind": "planetary", "teeth": (17, 85)}
    return RotaryAxis.model_validate(geared.plant(axis, **gear)), record


def table(rng: np.random.Generator, seed: int) -> Drawn:
    """A mass on guides."""
    C = rng.uniform(100.0, 400.0)
    bench = positioner.Table(M=rng.uniform(50.0, 140.0), F_d=rng.uniform(8.0, 40.0), C_positive=C, C_negative=C)
    plant = {**positioner.table_plant(bench), "C": 0.95 * C}
    return LinearAxis.model_validate(plant), positioner.table(bench, seed, seconds=8.0)


def servo(rng: np.random.Generator, seed: int) -> Drawn:
    """A geared servo that lifts a pendulum."""
    bench = positioner.Servo(
        J=0.012 * rng.uniform(0.7, 1.5), gravity=rng.uniform(0.2, 1.2), F_d=rng.uniform(0.03, 0.12), C=0.04
    )
    pendulum = {"pendulum": {"amplitude": bench.gravity, "phase": 0.0}}
    plant = {**positioner.servo_plant(bench), "effects": pendulum}
    return RotaryAxis.model_validate(plant), positioner.servo(bench, seed)


PLANTS: dict[str, Callable[[np.random.Generator, int], Drawn]] = {
    "geared motor, cascade": geared_motor,
    "table, cascade": table,
    "servo, position loop": servo,
}


def look(seed: int, number: int) -> dict[str, Any]:
    """Examine one drawn axis; what was said."""
    name = list(PLANTS)[number % len(PLANTS)]
    plant, record = PLANTS[name](np.random.default_rng([seed, number]), number)
    begun = time.process_time()
    whole = AxisPlant(plant, [record], n_threads=1)
    found = findings(whole, examine_ways(whole))
    return {
        "code": version(),
        "seed": seed,
        "number": number,
        "plant": name,
        "verdict": found.verdict,
        "effects": [[e.name, e.confidence, list(e.indistinguishable_from)] for e in found.effects],
        "balance": [[t["name"], t["confidence"]] for t in found.balance.get("terms", [])],
        "cpu_s": round(time.process_time() - begun, 1),
    }


def main() -> None:
    """Run what is missing, and print."""
    resumed.run(
        __doc__, "var/nulls_axis.jsonl", 102, look,
        lambda row: f"{row['plant']} {row['verdict']} {row['effects']} {row['balance']}", table_of,
    )  # fmt: skip


def table_of(rows: list[dict[str, Any]]) -> str:
    """By plant: how many, what was named, with the interval of 95 % of an alarm's rate."""
    lines = [
        "| plant | nulls | adequate | named below 90 % | sure names | laws of the balance | CPU s, median |",
        "|---|---|---|---|---|---|---|",
    ]
    for name in [*PLANTS, "all"]:
        own = [row for row in rows if name in ("all", row["plant"])]
        if not own:
            continue
        adequate = sum(row["verdict"] == "adequate" for row in own)
        alarms = sum(any(sure >= SURE for _, sure, _ in row["effects"]) for row in own)
        named = sum(bool(row["effects"]) for row in own) - alarms
        laws = sum(bool(row["balance"]) for row in own)
        cost = float(np.median([row["cpu_s"] for row in own]))
        lines.append(f"| {name} | {len(own)} | {adequate} | {named} | {alarms} | {laws} | {cost:.0f} |")
    n, alarms = len(rows), sum(any(sure >= SURE for _, sure, _ in row["effects"]) for row in rows)
    high = 100.0 * stats.beta.ppf(0.975, alarms + 1, max(n - alarms, 1)) if alarms < n else 100.0
    code = ", ".join(sorted({row["code"] for row in rows}))
    return "\n".join([*lines, "", f"{alarms} alarms in {n}, at most {high:.1f} % (95 %); commit {code}"])


if __name__ == "__main__":
    main()
