"""The balance in words and numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ema.core.records import Array
from ema.discrepancy.axis.balance.laws.law import Law
from ema.discrepancy.axis.balance.regressing.found import Balance, Term, draw, draw_law
from ema.discrepancy.axis.balance.regressing.regression import BELOW
from ema.discrepancy.axis.naming.interval import interval
from ema.discrepancy.axis.naming.linear import in_metres

from .telling_records import OF_BASE, SAID, by_record, quantities, quantity, short

SURE, CONTRADICTED = 0.9, 0.1
WORSE = 10.0  # times the error of the answer, from which numbers are not those of the axis
MADE_BY = {  # what makes a fitted value implausible
    "inertia": "a drive's torque that is late, or a gain of it that is wrong",
    "dry_friction": "drag in its place (one speed does not tell them apart), or a load that follows the motion",
    "viscous_drag": "friction that falls with speed, or a back-EMF constant that is too large",
    "share": "a load that the model has not, or a drive whose torque is wrong",
}


def describe(b: Balance, *, linear: bool) -> dict[str, Any]:
    """The balance for findings.json."""
    samples = draw(b)
    unit = "N" if linear else "N m"
    return {
        "drive_rms": short(b.drive**0.5),
        "unit": unit,
        "explained": {
            "plant_file": short(b.explained(b.left_plain)),
            "fitted": short(b.explained(b.left_base)),
            "with_laws": short(b.explained(b.left)),
        },
        "left_rms": short(b.left**0.5),
        "noise_rms": short(b.noise**0.5),
        "rows": len(b.model.rows.y),
        "test_function": short(2.0 * b.model.rows.half),
        "base": {name: _base(b, k, name, samples, linear) for k, name in enumerate(b.model.base)},
        **({"given": [of_given(b, law) for law in b.given]} if b.given else {}),
        "terms": [_term(b, term) for term in b.terms],
        **({"creeps": short(b.creeps)} if b.creeps else {}),
        **({"by_record": by_record(b.agreements, b.model.rows.motion.records, linear=linear)} if b.agreements else {}),
    }


def _nominal(b: Balance, name: str) -> float:
    return {"inertia": b.plain.inertia, "dry_friction": b.plain.F_d, "viscous_drag": b.plain.C}[name]


def _base(b: Balance, k: int, name: str, samples: Array, linear: bool) -> dict[str, Any]:
    nominal = _nominal(b, name)
    more = 0.0 if name == "inertia" else nominal  # friction and drag are fitted beside the plant file's
    value = float(b.corrected.coefficients[k]) + more
    unit = in_metres(OF_BASE[name]) if linear else OF_BASE[name]
    out = {**quantity(value, *interval(name, value, samples[:, k] + more), unit), "plant_file": nominal}
    if value < -BELOW * float(np.std(samples[:, k])):
        out["implausible"] = f"{SAID[name]} cannot be negative: it may be {MADE_BY[name]}"
    return out


def of_law(b: Balance, law: Law, drawn: Sequence[tuple[Law, Array]]) -> dict[str, Any]:
    """A law with its parameters, and their intervals of what was `drawn`."""
    values = law.values(b.corrected.coefficients[b.model.part(law)])
    return {
        "name": law.name,
        "parameters": quantities(law, values, [own.values(c) for own, c in drawn]),
        "sentence": law.sentence.format(**values),
    }


def of_given(b: Balance, law: Law) -> dict[str, Any]:
    """The same of a law that the plant file declares."""
    return of_law(b, law, [(law, c) for c in draw(b)[:, b.model.part(law)]])


def _term(b: Balance, term: Term) -> dict[str, Any]:
    values = term.law.values(b.corrected.coefficients[b.model.part(term.law)])
    out = {
        **of_law(b, term.law, draw_law(b, term)),
        "confidence": round(b.confidence(term), 4),
        "confidence_of_set": round(b.of_set(term), 4),
        "indistinguishable_from": list(term.others),
        "separated_by": term.law.separated_by,
        "share": short(term.power / b.drive),
    }
    if "share" in values and term.law.is_friction and values["share"] < 0.0:
        out["implausible"] = f"friction cannot fall below zero with load: it may be {MADE_BY['share']}"
    return out


def sentences(balance: dict[str, Any]) -> list[str]:
    """What an engineer would say of it."""
    what = "force" if balance["unit"] == "N" else "torque"
    parts = balance["explained"]
    base = ", ".join(_number(SAID[name], q) for name, q in balance["base"].items())
    base += "".join(f", and {law['sentence']}," for law in balance.get("given", ()))
    alone = f"{parts['fitted']:.1%}" if parts["fitted"] > 0.0 else "none"
    out = [f"Balance of {what} along the measured motion: {base} explain {alone} of the drive's {what}"]
    if balance["terms"]:
        found = "; ".join(_said(term) for term in balance["terms"])
        out[0] += f"; with {len(balance['terms'])} more, {_close(parts['with_laws'])}: {found}"
    left = balance["left_rms"] / max(balance["noise_rms"], 1e-300)
    out[0] += (
        f". {balance['left_rms']:.3g} {balance['unit']} rms is left, {left:.2g} times what the sensors' noise makes."
    )
    if share := balance.get("creeps"):
        out[0] += (
            f" {share:.0%} of it, where the axis creeps, is left out: friction acts otherwise there than in sliding."
        )
    run = balance.get("free_run", {})
    is_worse = run.get("err", 0.0) > WORSE * run.get("answer", np.inf)
    if is_worse:
        out[0] = (
            f"The balance says little here: free runs with its numbers miss {run['err']:.2%}, those of the answer "
            f"{run['answer']:.2%}. {out[0]}"
        )
    elif run:
        out[0] += f" Free runs with these numbers miss {run['err']:.2%} ({run['noise_floor']:.2%} is noise)."
    if loop := balance.get("closed_loop"):
        runs = " and ".join(f"the {name} {q['before']:.1%} before, {q['after']:.1%} after" for name, q in loop.items())
        out.append(f"Closed-loop runs over the whole record miss {runs}.")
    if records := balance.get("by_record"):
        out.append("Records beside each other: " + "; ".join(own["sentence"] for own in records) + ".")
    implausible = [q["implausible"] for q in (*balance["base"].values(), *balance["terms"]) if "implausible" in q]
    return [*out, *(f"{text[0].upper()}{text[1:]}." for text in implausible if not is_worse)]


def _close(share: float) -> str:
    return f"{share:.1%}" if share < 0.9945 else f"{share:.2%}"


def _number(name: str, q: dict[str, Any]) -> str:
    return f"{name} {q['value']:.3g} {q['unit']} ({q['low']:.3g} … {q['high']:.3g}; plant file {q['plant_file']:.3g})"


def _said(term: dict[str, Any]) -> str:
    if term["name"].endswith("_by_record") and term["confidence"] < CONTRADICTED:
        name = term["name"].removesuffix("_by_record").replace("_", " ")
        return f"something like {name}, in which the records contradict each other"
    q = next(iter(term["parameters"].values()))
    text = f"{term['sentence']} ({q['low']:.3g} … {q['high']:.3g})"
    if term["indistinguishable_from"]:
        text += f", or {' or '.join(term['indistinguishable_from'])}"
    sure = term["confidence_of_set"]
    return text if sure >= SURE else f"perhaps ({sure:.0%}) {text}"
