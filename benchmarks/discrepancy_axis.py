"""Blind table of the axis plant: effects hidden by tests/support, found (or not) by `ema.discrepancy`.

python -m benchmarks.discrepancy_axis [--seeds N] [--none N] [NAME…]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from scipy import stats

from ema.discrepancy.axis.plant import AxisPlant
from ema.discrepancy.examine import examine
from ema.models.axis_config import RotaryAxis

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support"))

CONFIDENT = 0.9


def look(names, seed):
    import axis_bench
    import hidden_axis

    bench, truth, rng = hidden_axis.bench_with(names, seed)
    plant = AxisPlant(RotaryAxis.model_validate(axis_bench.PLANT), [axis_bench.record(bench, rng)])
    return examine(plant), truth


def rate(outcome, name):
    """Right, in a set of two, in a larger set, wrong with confidence, or missed."""
    found = {e["name"] for e in outcome.effects}
    sets = [{e["name"], *e["indistinguishable_from"]} for e in outcome.effects]
    wrong = any(name not in s and e["confidence"] > CONFIDENT for s, e in zip(sets, outcome.effects, strict=True))
    if wrong:
        return "wrong" if not any(name in s for s in sets) else "with a wrong one"
    sizes = [len(s) for s in sets if name in s]
    if not sizes:
        return "missed"
    return "right" if name in found and min(sizes) == 1 else ("in two" if min(sizes) == 2 else "in more")


def main() -> None:
    import hidden_axis

    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--none", type=int, default=100)
    parser.add_argument("names", nargs="*")
    arguments = parser.parse_args()
    if arguments.none:
        alarms = sum(look([], seed)[0].verdict != "adequate" for seed in range(arguments.none))
        low, high = stats.binomtest(alarms, arguments.none).proportion_ci(0.95)
        print(
            f"nothing hidden: {alarms} alarms in {arguments.none} seeds, rate {low:.3f} to {high:.3f} (95 %)",
            flush=True,
        )
    columns = ("right", "in two", "in more", "with a wrong one", "wrong", "missed")
    print(f"{'hidden':22}" + "".join(f"{c:>17}" for c in columns) + f"{'rms after':>11}{'err after/floor':>17}")
    for name in arguments.names or [*hidden_axis.LIBRARY, *hidden_axis.OUTSIDE]:
        counts = dict.fromkeys(columns, 0)
        rms, ratio, verdicts = [], [], []
        for seed in range(arguments.seeds):
            outcome, _ = look([name], seed)
            rms.append(outcome.records[0].rms_after)
            ratio.append(outcome.heldout.err_after / outcome.heldout.noise_floor)
            verdicts.append(outcome.verdict)
            if name in hidden_axis.LIBRARY:
                counts[rate(outcome, name)] += 1
            else:  # outside the library nothing may be named with confidence
                sure = outcome.verdict != "unexplained" or any(e["confidence"] > CONFIDENT for e in outcome.effects)
                counts["wrong" if sure else "right"] += 1
        print(
            f"{name:22}" + "".join(f"{counts[c]:17d}" for c in columns)
            + f"{np.median(rms):11.2f}{np.median(ratio):17.2f}", flush=True,
        )  # fmt: skip


if __name__ == "__main__":
    main()
