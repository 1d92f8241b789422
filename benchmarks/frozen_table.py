"""The table of a frozen run, from its rows alone: Markdown, of one commit, with intervals of 95 % (Jeffreys)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import hidden_cases as cases
import numpy as np
from scipy.stats import beta, norm

Row = Mapping[str, Any]
CONFIDENT = 0.9
EXPLAINED = 1.2  # held-out error over noise, beyond which nothing may be called explained
QUIET = ("adequate", "explained")  # verdicts by which nothing more is said to be missing
SEEN = 5.0  # nats, 150 to 1, that the truth must have on the same without an effect: with less no finder can name it
VISIBLE = 1.2  # times what noise makes of the record; less cannot be missed
INVENTED = 0.01  # a fault that is not there
BINS = (0.0, 0.5, 0.8, 0.95, 1.0)
NOMINAL = (0.5, 0.9, 0.95)


class MixedCommitsError(Exception):
    """Rows of several commits, or of a changed working tree, are not one experiment."""


def of_one_commit(rows: Iterable[Row]) -> str:
    """The commit of all rows; MixedCommitsError where there is none."""
    commits = sorted({str(row.get("commit")) for row in rows})
    if len(commits) != 1:
        raise MixedCommitsError(f"rows of {len(commits)} commits ({', '.join(c[:9] for c in commits)}): must be of one")
    if commits[0].endswith("+") or commits[0] == "None":
        raise MixedCommitsError(f"rows of {commits[0]}: a changed working tree cannot be repeated; commit first")
    return commits[0]


def rate(count: int, n: int) -> str:
    """A share with its interval of 95 % (Jeffreys)."""
    if n == 0:
        return "none"
    low, high = (float(x) for x in beta.interval(0.95, count + 0.5, n - count + 0.5))
    return f"{count} of {n} ({low:.1%} to {high:.1%})"


def table(rows: Sequence[Row]) -> str:
    """Everything that is asked of a finder, and each stratum; MixedCommitsError where rows are of several commits."""
    commit = of_one_commit(rows)
    seen = [row for row in rows if row["outcome"] != "refused"]
    parts = [
        f"Commit `{commit[:9]}`, {len(rows)} trials, {len(rows) - len(seen)} of them refused.",
        markdown(("what", "measured", "aim"), _aims(seen)),
        "Calibration: of answers with a stated probability P, how many hold a true cause.",
        markdown(("P", "stated on average", "right"), reliability(_answers(seen))),
        *_posterior(seen),
        markdown(("stratum", "right, or in a set", "confidently wrong", "refused"), _strata(rows)),
    ]
    return "\n\n".join(parts)


def beside(rows: Sequence[Row], others: Sequence[Row]) -> str:
    """Two commits on the trials that both have; MixedCommitsError where either's rows are of several."""
    commits = [f"`{of_one_commit(of)[:9]}`" for of in (rows, others)]
    own, other = ({(row["stratum"], row["number"], row["seed"]): row for row in of} for of in (rows, others))
    both = [key for key in own if key in other]
    ends = [[row for row in (of[key] for key in both) if row["outcome"] != "refused"] for of in (own, other)]
    lines = [(what, old, new) for (what, new, _), (_, old, _) in zip(*map(_aims, ends), strict=True)]
    head = f"The {len(both)} trials that {' and '.join(commits)} have in common, with what is refused left out."
    return f"{head}\n\n{markdown(('what', commits[1], commits[0]), lines)}"


def history(runs: Iterable[Sequence[Row]]) -> str:
    """One line for each run, in the order given: what it had of what is asked first of a finder."""
    head = (
        "commit",
        "trials",
        "named, or in a set",
        "two or three at once",
        "sure and wrong",
        "alarms",
        "outside, said so",
    )
    lines = []
    for rows in runs:
        seen = [row for row in rows if row["outcome"] != "refused"]
        by_name = {what.partition(" (")[0]: measured for what, measured, _ in _aims(seen)}
        asked = (
            "named, or in a set that holds the truth",
            "two or three at once, named or in sets",
            "confidently wrong",
            "false alarms",
            "outside the library",
        )
        counts = [by_name[name].partition(" (")[0] for name in asked]
        lines.append((f"`{of_one_commit(rows)[:9]}`", str(len(rows)), *counts))
    return markdown(head, lines)


def markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def truth(row: Row) -> set[str]:
    """The effects that were hidden; rows of the actuator before they were written name their case only."""
    if "effects" in row:
        return set(row["effects"])
    return set(cases.case(row["case"]).effects)


def _answers(rows: Iterable[Row]) -> list[tuple[float, bool]]:
    """Stated probability of each named effect or set, and whether a true one, or what acts like it, is in it."""
    return [
        (p, bool(set(named) & (truth(row) | {*row.get("near", ()), *row.get("there", ())})))
        for row in rows
        for named, p in zip(row["named"], _of_sets(row), strict=True)
    ]


def _of_sets(row: Row) -> list[float]:
    """The probability of each set; rows before it was written have its first member's, taken to be each one's share."""
    told = row.get("of_set") or [None] * len(row["named"])
    shares = zip(told, row["named"], row["confidence"], strict=True)
    return [min(1.0, p * len(named)) if of_set is None else of_set for of_set, named, p in shares]


def _is_alarm(row: Row) -> bool:
    """Whether something is told of a bench without what is told: what it has of its own may be."""
    return bool(row["verdict"] != "adequate" and not (row.get("there") and row["outcome"] == "right"))


def reliability(answers: Sequence[tuple[float, bool]]) -> list[tuple[str, str, str]]:
    """The reliability diagram in rows: bin, mean of what was stated, share right."""
    out = []
    for low, high in pairwise(BINS):
        inside = [(p, right) for p, right in answers if low <= p < high or (high == BINS[-1] and p == high)]
        stated = f"{np.mean([p for p, _ in inside]):.2f}" if inside else ""
        right = rate(sum(r for _, r in inside), len(inside))
        out.append((f"{low:g} to {high:g}", stated, right))
    return out


def _posterior(rows: Sequence[Row]) -> list[str]:
    """The same of the first set of the posterior, where a row has one and its verdict says that nothing else is left.

    Beside a rest these are odds of the sets that were fitted, given that one of them is right.
    """
    firsts = [(row["posterior"][0], row) for row in rows if row.get("posterior") and row["verdict"] in QUIET]
    if not firsts:
        return []
    answers = [(float(first["probability"]), set(first["effects"]) == truth(row)) for first, row in firsts]
    return [
        "The same of the first set of the posterior, where nothing else is left: exactly the hidden effects.",
        markdown(("P", "stated on average", "right"), reliability(answers)),
    ]


def coverage(z: Sequence[float]) -> list[tuple[str, str]]:
    """How many true values lie in intervals of 50, 90 and 95 %, from deviations in claimed standard deviations."""
    reach = [float(norm.ppf(0.5 + 0.5 * p)) for p in NOMINAL]
    return [
        (f"intervals of {p:.0%} that hold the truth", rate(sum(abs(x) <= r for x in z), len(z)))
        for p, r in zip(NOMINAL, reach, strict=True)
    ]


def _aims(rows: Sequence[Row]) -> list[tuple[str, str, str]]:
    silent = [row for row in rows if not truth(row) and not _is_outside(row)]
    outside = [row for row in rows if _is_outside(row)]
    hiding = [row for row in rows if truth(row)]
    visible = [row for row in hiding if not _is_unseen(row)]
    several = [row for row in visible if len(truth(row)) > 1]
    named = [row for row in visible if row["outcome"] in ("right", "in set")]
    in_two = [row for row in named if all(len(s) <= 2 for s in row["named"])]
    wrong = [row for row in rows if _is_confidently_wrong(row)]
    said = [row for row in outside if row["outcome"] == "right"]
    kinds = {row["case"] for row in outside}
    z = [x for row in rows for x in (*row["z"].values(), *row.get("z_k", {}).values())]
    known = [row for row in rows if row.get("k_after")]
    false = [row for row in known if _is_invented(row)]
    loud = [row for row in rows if row["verdict"] == "explained" and row["err_after"] > EXPLAINED * row["noise_floor"]]
    explained = [row for row in rows if row["verdict"] == "explained"]
    cpu = [row["cpu_s"] for row in rows]
    both = [row for row in several if row in named]
    return [
        ("named, or in a set that holds the truth", rate(len(named), len(visible)), ""),
        ("named, or in a set of two", rate(len(in_two), len(visible)), "≥ 97 %"),
        ("hidden and not to be seen", f"{len(hiding) - len(visible)} of {len(hiding)}", ""),
        ("two or three at once, named or in sets", rate(len(both), len(several)), "≥ 95 %"),
        (f"confidently wrong (P ≥ {CONFIDENT:g}, extra effects included)", rate(len(wrong), len(rows)), "≤ 0.5 %"),
        ("false alarms", rate(sum(_is_alarm(row) for row in silent), len(silent)), "none"),
        (f"outside the library ({len(kinds)} kinds), said so", rate(len(said), len(outside)), "≥ 95 %"),
        *((what, share, "± 4 points") for what, share in coverage(z)),
        ("trials with a fault above 1 % that is not there", rate(len(false), len(known)), "≤ 1 %"),
        ("explained with more than 1.2 noise floors left", rate(len(loud), len(explained)), "none"),
        ("processor time, median and 99 % [s]", _quantiles(cpu), "30, 120"),
    ]


def _quantiles(cpu: Sequence[float]) -> str:
    return f"{np.median(cpu):.0f}, {np.quantile(cpu, 0.99):.0f}" if cpu else "none"


def _is_outside(row: Row) -> bool:
    return bool(row["stratum"] == "outside the library")


def _is_unseen(row: Row) -> bool:
    nats, visible = row.get("nats"), row.get("visible")  # of what is not named: the axis', the actuator's
    if row["outcome"] != "missed" or nats is not None:
        return nats is not None and nats < SEEN
    return row["verdict"] in QUIET and visible is not None and visible < VISIBLE


def _is_confidently_wrong(row: Row) -> bool:
    """A cause that is stated as sure and is not there, whatever else is named."""
    return any(p >= CONFIDENT and not right for p, right in _answers([row]))


def _is_invented(row: Row) -> bool:
    """A fault that is told and is not there; where intervals were told, one that holds nothing tells none."""
    lows = [low for low, _ in row["k_interval"]] if row.get("k_interval") else row["k_after"]
    told = zip(row["k_after"], lows, row["k"], strict=True)
    return any(k > INVENTED and low > 0.0 and true == 0.0 for k, low, true in told)


def _strata(rows: Sequence[Row]) -> list[tuple[str, str, str, str]]:
    out = []
    for stratum in dict.fromkeys(str(row["stratum"]) for row in rows):
        these = [row for row in rows if row["stratum"] == stratum]
        seen = [row for row in these if row["outcome"] != "refused"]
        count: Callable[[Callable[[Row], bool]], str] = lambda is_so: rate(sum(map(is_so, seen)), len(seen))  # noqa: B023, E731
        good = count(lambda row: row["outcome"] in ("right", "in set"))
        out.append((stratum, good, count(_is_confidently_wrong), str(len(these) - len(seen))))
    return out
