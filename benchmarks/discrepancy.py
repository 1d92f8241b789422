"""The blind harness at length: hide flaws by other code, find them from records alone, print the table.

Resumable: every trial is a line of the results file, and a trial that is there is not run again.

    python -m benchmarks.discrepancy --seeds 20 --out var/discrepancy.jsonl
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import click
import hidden_actuator as hidden
import hidden_cases as cases
import numpy as np

from benchmarks.frozen_table import QUIET, VISIBLE, rate
from benchmarks.kernel import costs
from ema.core import config, resources
from ema.core.errors import RecordError
from ema.core.names import FAULTS
from ema.core.records import Cycle, Record
from ema.core.version import version
from ema.discrepancy.actuator.examine import examine
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.models.actuator import Actuator

CONFIDENT = 0.9
VERSION = version()  # at the start: the tree may change under a long run


def trial(name: str, seed: int, n_cycles: int, *, varied: bool = True, n_threads: int = 2) -> dict[str, Any]:
    """One hidden flaw, found or not."""
    values, k = cases.draw(name, seed)
    motions, bench = cases.draw_bench(hidden, name, seed) if varied else (hidden.MOTIONS, hidden.Bench())
    plant = config.load(resources.config("actuator.yaml"), Actuator)
    told = {"case": name, "seed": seed, "version": VERSION, "motions": "varied" if varied else "test chirps"}
    return told | examined(plant, name, values, k, n_cycles, seed, motions, bench, n_threads)


def examined(
    plant: Actuator, name: str, values: dict[str, float], k: list[float], n_cycles: int, seed: int,
    motions: Any, bench: Any, n_threads: int, spoiled: Callable[[Cycle], Cycle] = lambda cycle: cycle,
    made: tuple[str, ...] = (),
) -> dict[str, Any]:  # fmt: skip
    """Hide a flaw, look for it, and lay what is found beside what was hidden.

    `spoiled` is what a recorder does, `made` names the effects that are just that.
    """
    record = recorded(values, k, n_cycles, seed, motions, bench, spoiled)
    begun = time.process_time()
    told = {"hidden": values, "k": k}
    try:
        data = prepare(plant, [record])
    except RecordError as error:
        return {**told, "outcome": "refused", "said": [str(error)]}
    examination = examine(plant, data, n_threads=n_threads)
    cost = costs(examination.search.plant.work, time.process_time() - begun)
    scored = beside_truth(name, values, k, n_cycles, seed, motions, bench, examination.findings.as_dict(), made)
    return {**told, **scored, **cost}


def recorded(
    values: dict[str, float], k: list[float], n_cycles: int, seed: int, motions: Any, bench: Any,
    spoiled: Callable[[Cycle], Cycle] = lambda cycle: cycle,
) -> Record:  # fmt: skip
    """The record of a flaw."""
    made = enumerate(hidden.cycles(_flaws(values, k), n_cycles, seed, motions, bench))
    return Record(tuple(spoiled(Cycle(n, c)) for n, c in made))


def _flaws(values: dict[str, float], k: list[float]) -> Any:
    return hidden.Flaws(**values, **{f"k{j + 1}": x for j, x in enumerate(k)})


def beside_truth(
    name: str, values: dict[str, float], k: list[float], n_cycles: int, seed: int, motions: Any, bench: Any,
    findings: dict[str, Any], made: tuple[str, ...] = (),
) -> dict[str, Any]:  # fmt: skip
    """What is in findings.json, laid beside what was hidden and what the recorder `made`, which may be named too."""
    found = {f"{e['name']}.{p}": q for e in findings["effects"] for p, q in e["parameters"].items()}
    true = {p: truth(values) for p, truth in cases.case(name).parameters.items() if p in found}
    sd = {p: (found[p]["high"] - found[p]["low"]) / 3.92 for p in true}
    gain = findings["gain"]
    outcome = cases.outcome(name, findings, made)
    is_missed = outcome == "missed"
    return {
        "outcome": outcome, "verdict": findings["verdict"],
        "visible": _visible(name, findings, _flaws(values, k), n_cycles, seed, motions, bench) if is_missed else None,
        "named": [[e["name"], *e["indistinguishable_from"]] for e in findings["effects"]],
        "confidence": [e["confidence"] for e in findings["effects"]],
        "of_set": [e.get("of_set") for e in findings["effects"]],
        "parameter_errors": {p: found[p]["value"] / x - 1.0 for p, x in true.items() if x},
        "z": {p: (found[p]["value"] - x) / sd[p] for p, x in true.items() if sd[p] > 0.0},
        "covered": {p: found[p]["low"] <= x <= found[p]["high"] for p, x in true.items()}, **gain["heldout"],
        "k_after": gain["k_after"], "k_interval": gain.get("k_interval"), "z_k": _z_k(gain, k),
        "posterior": findings.get("posterior", [])[:5],
        "err_k_before": _err_k(gain["k_before"], k), "err_k_after": _err_k(gain["k_after"], k),
        "false_alarms": [gain["false_alarms_before"], gain["false_alarms_after"]],
        "tried": findings["tried"][:8], "said": findings["structure"].get("sentences", []) + findings["notes"],
    }  # fmt: skip


def _visible(name: str, findings: dict[str, Any], *of: Any) -> float:
    """What is missed of a flaw, by the part of it that is seen best: each is seen, or not, beside the others."""
    flaws, *bench = of
    return max(cases.visibility(hidden, flaws, part, *bench) for part in cases.unseen(name, findings))


def _z_k(gain: dict[str, Any], k: list[float]) -> dict[str, float]:
    """Deviations of the faults that are there; of those that are not, an interval ends at nothing."""
    ends = zip(FAULTS, gain["k_after"], gain.get("k_interval", []), k, strict=False)
    sd = {name: (max(x - low, high - x) / 1.96, x - true) for name, x, (low, high), true in ends if true > 0.0}
    return {name: off / of for name, (of, off) in sd.items() if of > 0.0}


def _told(row: dict[str, Any]) -> str:
    """The outcome; "unseen" where the flaw makes no more of the record than noise does."""
    unseen = row["outcome"] == "missed" and row["verdict"] in QUIET and row["visible"] < VISIBLE
    return "unseen" if unseen else str(row["outcome"])


def _err_k(found: list[float], truth: list[float]) -> float:
    return float(np.linalg.norm(np.array(found) - truth) / np.sqrt(6.0))


def _rates(hiding: list[dict[str, Any]], kind: str) -> list[str]:
    """How often something hidden that can be seen is named, and whether the intervals hold."""
    if not hiding:
        return []
    good = sum(row["outcome"] in ("right", "in set") for row in hiding)
    bad = sum(row["outcome"] == "wrong" and max(row["confidence"], default=0.0) >= CONFIDENT for row in hiding)
    inside = [x for row in hiding for x in row["covered"].values()]
    known = [row for row in hiding if row["outcome"] == "right" and not cases.case(row["case"]).outside]
    close = sum(row["err_after"] <= 1.2 * row["noise_floor"] for row in known)
    return [
        f"{kind}right or in the set: {rate(good, len(hiding))}; confidently wrong: {rate(bad, len(hiding))}",
        f"{kind}95 % intervals of parameters that hold the truth: {rate(sum(inside), len(inside))}",
        f"{kind}held-out err_i within 1.2 noise floors where named right: {rate(close, len(known))}",
    ]


def table(rows: list[dict[str, Any]]) -> str:
    """The results by case."""
    head = f"{'hidden':30s} {'n':>3} {'right':>5} {'set':>4} {'wrong':>5} {'missed':>6} {'unseen':>6} {'param.':>7}"
    lines = [head + "  err_i before after floor [mA]  err_k before after"]
    refused, rows = ([row for row in rows if (row["outcome"] == "refused") is yes] for yes in (True, False))
    for name in dict.fromkeys(cases.kind(row["case"]) for row in rows):
        these = [row for row in rows if cases.kind(row["case"]) == name]
        count = {o: sum(_told(row) == o for row in these) for o in ("right", "in set", "wrong", "missed", "unseen")}
        parameter = [abs(x) for row in these for x in row["parameter_errors"].values()]
        median = {key: float(np.median([row[key] for row in these]))
                  for key in ("err_before", "err_after", "noise_floor", "err_k_before", "err_k_after")}  # fmt: skip
        lines.append(
            f"{name:30s} {len(these):3d} {count['right']:5d} {count['in set']:4d} {count['wrong']:5d} "
            f"{count['missed']:6d} {count['unseen']:6d} {np.median(parameter) if parameter else np.nan:7.1%}  "
            f"{1e3 * median['err_before']:12.1f} {1e3 * median['err_after']:5.1f} {1e3 * median['noise_floor']:5.1f}"
            f"{'':7s}{median['err_k_before']:12.4f} {median['err_k_after']:.4f}"
        )
    alarms = [row for row in rows if row["case"] in ("none", "faults")]
    hiding = [row for row in rows if row not in alarms and _told(row) != "unseen"]
    several = [row for row in hiding if row["case"] not in cases.CASES]
    lines += _rates([row for row in hiding if row not in several], "")
    lines += _rates(several, "two or three effects at once: ")
    cpu = [row["cpu_s"] for row in rows]
    lines.append(f"processor time of a trial: median {np.median(cpu):.0f} s, largest {max(cpu):.0f} s")
    times = [row["times_limit"] for row in rows if "times_limit" in row]  # older rows do not say
    if times:
        lines.append(
            f"over what full lanes of the kernel would take: median {np.median(times):.1f}, largest {max(times):.1f}"
        )
    if alarms:
        lines.append(
            f"false alarms without an effect: {rate(sum(row['verdict'] != 'adequate' for row in alarms), len(alarms))}"
        )
    lines += [f"refused: {row['case']} {row['seed']}: {row['said'][0]}" for row in refused]
    return "\n".join(lines)


def _wanted(seeds: range, n_none: int, only: Sequence[str]) -> Iterator[tuple[str, int]]:
    """Cases and seeds: each case, two and three effects at once; more seeds of no flaw, since alarms are rare."""
    for seed in seeds:
        for name in only or (*cases.CASES, *cases.PAIRS, cases.together(2, seed), cases.together(3, seed)):
            yield name, seed
    if seeds and not only:
        for seed in range(seeds.stop, seeds.start + n_none):
            yield from (("none", seed), ("faults", seed))


@click.command()
@click.option("--seeds", default=20, show_default=True)
@click.option("--first", default=0, show_default=True, help="first seed")
@click.option("--case", "only", multiple=True, help="only these (repeatable)")
@click.option(
    "--none", "n_none", default=100, show_default=True, help="at least so many seeds of no flaw, and of faults"
)
@click.option("--cycles", default=6, show_default=True, help="recorded cycles of a trial")
@click.option("--varied/--test-chirps", default=True, show_default=True, help="motions, noise, place of many benches")
@click.option("--threads", default=2, show_default=True)
@click.option("--out", type=click.Path(path_type=Path), default=Path("var/discrepancy.jsonl"), show_default=True)
def main(
    seeds: int, first: int, only: tuple[str, ...], n_none: int, cycles: int, varied: bool, threads: int, out: Path
) -> None:  # fmt: skip
    """Run missing trials and print the table."""
    out.parent.mkdir(parents=True, exist_ok=True)
    rows = [json.loads(line) for line in out.read_text().splitlines()] if out.exists() else []
    done = {(row["case"], row["seed"]) for row in rows}
    for name, seed in _wanted(range(first, first + seeds), n_none, only):
        if (name, seed) not in done:
            row = trial(name, seed, cycles, varied=varied, n_threads=threads)
            rows.append(row)
            with out.open("a") as file:
                file.write(json.dumps(row) + "\n")
            click.echo(f"{name} {seed}: {row['outcome']} {row.get('verdict')} {row.get('named')}", err=True)
    click.echo(table([row for row in rows if not only or row["case"] in only]))


if __name__ == "__main__":
    main()
