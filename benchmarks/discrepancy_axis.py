"""Blind table of the axis plant: effects hidden by tests/support, found (or not) by `ema.discrepancy`.

python -m benchmarks.discrepancy_axis [--seeds N] [--none N] [--first N] [--log FILE] [NAME…]

Seed by seed through all effects; every answer is appended to the log as one line of JSON, and a log can be continued or
printed alone (--seeds 0 --none 0).
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import axis_bench
import hidden_axis
import numpy as np
from scipy import stats

from ema.core.version import version
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import RotaryAxis

CONFIDENT = 0.9
COLUMNS = ("right", "in two", "in more", "unsure", "with a wrong one", "wrong", "missed")
NOTHING = "nothing"


def look(names, seed):
    """Examine a drawn bench with `names` hidden in it; what was said, as plain numbers."""
    bench, plant_file, motions = hidden_axis.drawn(seed)
    F_d = bench.F_d
    bench, truth, rng = hidden_axis.bench_with(names, seed, bench)
    record = axis_bench.record(bench, rng, motions=motions)
    plant = AxisPlant(RotaryAxis.model_validate(plant_file), [record], n_threads=1)
    begun = time.process_time()
    o = examine_ways(plant)
    return {
        "code": version(),
        "cpu_s": round(time.process_time() - begun, 1),
        "hidden": "+".join(names) or NOTHING,
        "seed": seed,
        "truth": {name: {key: float(x) for key, x in values.items()} for name, values in truth.items()},
        "noise": "declared" if "noise" in plant_file else "estimated",
        "verdict": o.verdict,
        "p_value": o.p_value,
        "effects": [
            [
                e["name"],
                e["confidence"],
                e["indistinguishable_from"],
                {k: q["value"] for k, q in e["parameters"].items()},
            ]
            for e in o.effects
        ],
        "structure": [term["sentence"] for term in o.structure.get("terms", [])],
        "rms": [o.records[0].rms_before, o.records[0].rms_after],
        "friction": [o.k_before[0] / F_d - 1.0, o.k_after[0] / F_d - 1.0],
        "error": [o.folds.err_before, o.folds.err_after, o.folds.noise_floor],
    }


def rate(answer: dict[str, Any], names: list[str]) -> str:
    """Right, in a set of two, in a larger set, right but unsure, wrong with confidence, or missed."""
    effects = answer["effects"]
    sets = [{name, *others} for name, _, others, _ in effects]
    wrong = any(sure > CONFIDENT and not s & set(names) for s, (_, sure, _, _) in zip(sets, effects, strict=True))
    found = all(any(name in s for s in sets) for name in names)
    if wrong:
        return "with a wrong one" if found else "wrong"
    if not found:
        return "missed"
    own = [(s, e) for s, e in zip(sets, effects, strict=True) if s & set(names)]
    largest = max(min(len(s) for s in sets if name in s) for name in names)
    if largest > 1:
        return "in two" if largest == 2 else "in more"
    return "right" if all(sure > CONFIDENT for _, (_, sure, _, _) in own) else "unsure"


def rate_outside(answer: dict[str, Any]) -> str:
    """Outside the library nothing may be named with confidence, and the verdict must say that a rest is left."""
    if any(sure > CONFIDENT for _, sure, _, _ in answer["effects"]):
        return "wrong"
    return "right" if answer["verdict"] in ("unexplained", "partly explained") else "missed"


def parameter_error(answer: dict[str, Any]) -> float:
    """Relative error of the first parameter of a hidden effect that was named; NaN where none was."""
    for name, _, _, values in answer["effects"]:
        for key, true in list(answer["truth"].get(name, {}).items())[:1]:
            if key in values:
                return abs(values[key] / true - 1.0)
    return float("nan")


def interval(count: int, n: int) -> str:
    """Share with its interval of 95 % (Clopper and Pearson)."""
    low, high = stats.binomtest(count, n).proportion_ci(0.95)
    return f"{count} of {n} ({100 * low:.1f} to {100 * high:.1f} %)"


def table(answers: list[dict[str, Any]]) -> None:
    """Print what was found."""
    import hidden_axis

    none = [a for a in answers if a["hidden"] == NOTHING]
    if none:
        print("nothing hidden, alarms:", interval(sum(a["verdict"] != "adequate" for a in none), len(none)))
    print(
        f"{'hidden':32}{'seeds':>6}"
        + "".join(f"{c:>17}" for c in COLUMNS)
        + f"{'parameter':>11}{'rms after':>11}{'err/floor':>11}{'F_d before':>12}{'after':>8}"
    )
    within = {True: [0, 0, 0], False: [0, 0, 0]}  # library or not: right or in two, wrong, all
    for hidden in dict.fromkeys(a["hidden"] for a in answers if a["hidden"] != NOTHING):
        mine = [a for a in answers if a["hidden"] == hidden]
        names = hidden.split("+")
        outside = any(name in hidden_axis.OUTSIDE for name in names)
        rated = [rate_outside(a) if outside else rate(a, names) for a in mine]
        for k, which in enumerate((("right", "in two"), ("wrong", "with a wrong one"), COLUMNS)):
            within[not outside][k] += sum(r in which for r in rated)
        errors = [e for a in mine if np.isfinite(e := parameter_error(a))]
        friction = 100.0 * np.median(np.abs([a["friction"] for a in mine]), axis=0)
        print(
            f"{hidden:32}{len(mine):6d}"
            + "".join(f"{rated.count(c):17d}" for c in COLUMNS)
            + (f"{100 * np.median(errors):10.1f}%" if errors else f"{'':11}")
            + f"{np.median([a['rms'][1] for a in mine]):11.2f}"
            + f"{np.median([a['error'][1] / a['error'][2] for a in mine]):11.2f}"
            + f"{friction[0]:11.1f}%{friction[1]:7.1f}%"
        )
    for library, (good, wrong, n) in within.items():
        if n:
            print(
                "library:" if library else "outside:", "right or in two", interval(good, n), "wrong", interval(wrong, n)
            )
    print("code:", ", ".join(sorted({a["code"] for a in answers})))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--none", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--log", type=Path)
    parser.add_argument("names", nargs="*", help="effects to hide, several at once as A+B")
    arguments = parser.parse_args()
    version()  # before files change under a long run
    answers = []
    if arguments.log and arguments.log.exists():
        answers = [json.loads(line) for line in arguments.log.read_text().splitlines()]
    done = {(a["hidden"], a["seed"]) for a in answers}
    wanted = [(NOTHING, seed) for seed in range(arguments.first, arguments.first + arguments.none)]
    for seed in range(arguments.first, arguments.first + arguments.seeds):
        wanted += [(name, seed) for name in arguments.names or [*hidden_axis.LIBRARY, *hidden_axis.OUTSIDE]]
    for hidden, seed in wanted:
        if (hidden, seed) in done:
            continue
        answers.append(look([] if hidden == NOTHING else hidden.split("+"), seed))
        if arguments.log:
            with arguments.log.open("a") as file:
                file.write(json.dumps(answers[-1]) + "\n")
    table(answers)


if __name__ == "__main__":
    main()
