"""What records given together agree on and what not, in words and numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ema.discrepancy.axis.balance.laws.law import BY_RECORD, Law
from ema.discrepancy.axis.balance.regressing.agreement import USUAL, Agreement
from ema.discrepancy.axis.balance.regressing.found import N_DRAWS
from ema.discrepancy.axis.naming.interval import interval
from ema.discrepancy.axis.naming.linear import in_metres
from ema.discrepancy.findings import WITHIN

SAID = {"inertia": "inertia", "dry_friction": "dry friction", "viscous_drag": "drag"}
OF_BASE = {"inertia": "kg m^2", "dry_friction": "N m", "viscous_drag": "N m s/rad"}
ELSE = "a neighbour's magnets, a sensor, another zero of the angle or another setting may act in one of them"


def by_record(found: Sequence[Agreement], records: Sequence[str], *, linear: bool) -> list[dict[str, Any]]:
    """One entry for each coefficient: its values by record with intervals, the test, and a sentence."""
    out = []
    for a in found:
        values = {name: _values(a, k, linear=linear) for k, name in enumerate(records)}
        agree = a.is_one(len(found))
        entry = {
            "name": a.name,
            **({"law": a.law.key.removesuffix(BY_RECORD)} if a.law is not None else {}),
            "records": values,
            "chi2": short(a.chi2),
            "dof": a.dof,
            "p": short(a.p),
            "agree": agree,
            "shown_by": [name for name, shown in zip(records, a.shown, strict=True) if shown],
            "could_be_shown_by": [name for name, could in zip(records, a.could, strict=True) if could],
        }
        out.append({**entry, "sentence": _sentence(a, entry)})
    return out


def _values(a: Agreement, k: int, *, linear: bool) -> dict[str, Any]:
    if a.law is None:
        unit = in_metres(OF_BASE[a.name]) if linear else OF_BASE[a.name]
        spread = WITHIN * float(np.sqrt(a.covariance[k][0, 0]))
        own_value = float(a.values[k, 0])
        return {"value": quantity(own_value, own_value - spread, own_value + spread, unit)}
    own = a.law.repeats or a.law
    drawn = np.random.default_rng(0).multivariate_normal(a.values[k], a.covariance[k], N_DRAWS, method="eigh")
    return quantities(own, own.values(a.values[k]), [own.values(c) for c in drawn])


def quantities(
    law: Law, values: Mapping[str, float], drawn: Sequence[Mapping[str, float]]
) -> dict[str, dict[str, Any]]:
    """The parameters of a law with intervals of 95 %, which `drawn` have."""
    return {
        name: quantity(values[name], *interval(name, values[name], [s[name] for s in drawn]), unit)
        for name, unit in law.parameters.items()
    }


def quantity(value: float, low: float, high: float, unit: str) -> dict[str, Any]:
    """A value with its interval and unit, for findings.json."""
    return {"value": short(value), "low": short(low), "high": short(high), "unit": unit}


def short(x: float) -> float:
    """Five digits."""
    return float(f"{x:.5g}")


def _sentence(a: Agreement, entry: dict[str, Any]) -> str:
    said = SAID.get(a.name, entry.get("law", a.name).replace("line ", "torque of order "))
    each = ", ".join(f"{_all(values)} in {name}" for name, values in entry["records"].items())
    test = f"χ² = {a.chi2:.3g} of {a.dof}, p = {a.p:.1g}"
    missing = [name for name in entry["records"] if name not in entry["shown_by"]]
    if entry["agree"]:
        text = f"{said}: the records agree ({test})" if a.p >= USUAL else f"{said}: nearly the same, {each} ({test})"
        if len(entry["shown_by"]) == 1:
            blind = [name for name in missing if name not in entry["could_be_shown_by"]]
            text = f"{said}: seen in {entry['shown_by'][0]} only" + (
                f"; {_and(blind)} could not show it" if blind else ""
            )
        return text
    if a.why:
        return f"{said} differs by record: {each} ({test}): {a.why}"
    if missing and len(entry["shown_by"]) == 1:
        return f"{said}: seen in {entry['shown_by'][0]} only, and {_and(missing)} would show it ({test}): {ELSE}"
    return f"{said}: the records contradict each other: {each} ({test}): {ELSE}"


def _and(names: Sequence[str]) -> str:
    return " and ".join(names)


def _all(values: dict[str, Any]) -> str:
    """What was fitted; of a line also where it lies."""
    fitted = [(name, q) for name, q in values.items() if q["low"] != q["high"] or name == "value"]
    return " at ".join(f"{'phase ' * name.startswith('phase')}{q['value']:.3g} {q['unit']}" for name, q in fitted)
