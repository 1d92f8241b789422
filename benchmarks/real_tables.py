"""The tables of a run over real benches, from its rows alone: verdicts, coefficients beside published ones, ripple."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from benchmarks.frozen import with_block
from benchmarks.frozen_table import Row, markdown, of_one_commit

SAID = {
    "inertia": "own inertia, rotor and gear with it [kg m²]",
    "linked_axis.inertia": "by the other's acceleration [kg m²]",
    "linked_axis.coupling": "coupling m_2 r_2 l_1 [kg m²]",
    "linked_axis.gravity": "gravity of the inner link [N m]",
    "linked_axis.gravity_outer": "gravity m_2 r_2 g [N m]",
    "dry_friction": "dry friction [N m]",
    "viscous_drag": "drag [N m s/rad]",
}
SURE = 0.9
REFUSED = 2  # exit status of `ema`


def tables(rows: Sequence[Row]) -> dict[str, str]:
    """The Markdown of each block; MixedCommitsError where rows are of several commits."""
    head = f"Commit `{of_one_commit(rows)[:9]}`."
    answered = [row for row in rows if row["exit"] == 0]
    refused = [f"- `{_files(row)}`: {row['said'].removeprefix('ema: ')}" for row in rows if row["exit"] == REFUSED]
    joints = [row for row in answered if "published" in row]
    return {
        "records": f"{head}\n\n{markdown(('bench, record', *ANSWER), map(_answer, answered))}",
        "balance": f"{head}\n\n{markdown(('bench, record', *BALANCE), map(_balance, answered))}",
        "published": f"{head}\n\n{markdown(('', *_titles(joints)), _beside(joints))}",
        "ripple": f"{head}\n\n{markdown(RIPPLE, _ripple(answered))}",
        "refused": "\n".join([head, "", *refused]),
    }


def fill(rows: Sequence[Row], page: str | None) -> str:
    """The page with each table in its block; without a page the tables one after the other."""
    made = tables(rows)
    if page is None:
        return "\n\n".join(made.values())
    for name, text in made.items():
        page = with_block(page, f"real {name}", text)
    return page


ANSWER = (
    "verdict",
    "causes, and how sure",
    "held-out error before → after (noise)",
    "over noise",
    "processor time [s]",
)
BALANCE = ("plant file", "fitted", "with laws", "laws, in the order found", "left, over noise")
RIPPLE = ("record", "order per turn", "speed ripple [turns/s]", "as by a torque [µN m]", "as by the encoder [mrad]")


def _files(row: Row) -> str:
    return ", ".join(name.rpartition("/")[2].removesuffix(".csv") for name in row["records"])


def _title(row: Row) -> str:
    return row["bench"] if len(row["records"]) > 1 else f"{row['bench']}, `{_files(row)}`"


def _answer(row: Row) -> tuple[str, ...]:
    held = row["gain"]["heldout"]
    error = f"{held['err_before']:.3g} → {held['err_after']:.3g} ({held['noise_floor']:.2g})"
    folds = row["gain"].get("residual") or row["gain"].get("folds") or {}
    left = f"{folds['rest']:.2g}" if "rest" in folds else ""
    return _title(row), row["verdict"], _causes(row["effects"]) or "none", error, left, f"{row['cpu_s']:.0f}"


def _causes(effects: Iterable[dict[str, Any]]) -> str:
    """Causes with their first size, lines with their order, and the probability of the set; sure ones first."""
    return "; ".join(_cause(e) for e in sorted(effects, key=lambda e: e.get("of_set", e["confidence"]) < SURE))


def _cause(e: dict[str, Any]) -> str:
    p = e.get("of_set", e["confidence"])
    order = e["parameters"].get("order")
    others = "".join(f" or {name}" for name in e["indistinguishable_from"])
    size = next((q for name, q in e["parameters"].items() if name != "order"), None)
    line = f" of order {order['value']:g}" if order else ""
    text = f"{e['name']}{line}{others}"
    text += f", {size['value']:.3g} {size['unit']} ({size['low']:.3g} … {size['high']:.3g})" if size else ""
    return f"{'' if p >= SURE else 'perhaps '}{text}, {p:.0%}"


def _balance(row: Row) -> tuple[str, ...]:
    b = row.get("balance")
    if not b:
        return _title(row), *["none"] * len(BALANCE)
    shares = [f"{x:.1%}" if x > 0.0 else "below 0" for x in b["explained"].values()]
    laws = _causes(
        [*({"confidence": 1.0, "indistinguishable_from": [], **law} for law in b.get("given", ())), *b["terms"]]
    )
    return _title(row), *shares, laws or "none", f"{b['left_rms'] / b['noise_rms']:.2g}"


def _titles(joints: Sequence[Row]) -> list[str]:
    return [cell for row in joints for cell in (row["bench"], "published")]


def _beside(joints: Sequence[Row]) -> list[list[str]]:
    """Each coefficient of each joint with its interval of 95 %, bold where that does not hold the published one."""
    return [[said, *(cell for row in joints for cell in _pair(row, name))] for name, said in SAID.items()]


def _pair(row: Row, name: str) -> tuple[str, str]:
    truth = row["published"].get(name)
    if truth is None:
        return "", ""
    q = found(row, name)
    value = f"{q['value']:.3g}" if q["low"] <= truth <= q["high"] else f"**{q['value']:.3g}**"
    return f"{value} ({q['low']:.3g} … {q['high']:.3g})", f"{truth:.3g}"


def found(row: Row, name: str) -> dict[str, Any]:
    """A coefficient of the balance with its interval: of inertia, friction and drag, or `law.parameter` of a law."""
    law, _, parameter = name.rpartition(".")
    balance = row["balance"]
    if not law:
        return dict(balance["base"][name])
    return dict(next(g for g in balance["given"] if g["name"] == law)["parameters"][parameter])


def _ripple(rows: Iterable[Row]) -> list[tuple[str, ...]]:
    return [
        (line["record"], f"{line['order']}", f"{line['amplitude'] / (2.0 * math.pi):.4f}",
         f"{1e6 * line['torque']:.3g}", f"{1e3 * line['encoder']:.2g}")
        for row in rows
        for line in row["structure"].get("ripple", ())
    ]  # fmt: skip
