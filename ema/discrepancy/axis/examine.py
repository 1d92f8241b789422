"""The engine's outcome on an axis in the form of findings.json."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ema.core.records import Record
from ema.discrepancy import findings as shared
from ema.discrepancy.grade import grade
from ema.discrepancy.outcome import Outcome
from ema.discrepancy.progress import Progress
from ema.discrepancy.report import Picture
from ema.effects import registry
from ema.models import axis_config

from .balance.regressing.found import Balance
from .balance.telling.as_effects import effects, point
from .balance.telling.telling import describe, sentences
from .finding.between import SAID, examine_ways
from .finding.plant import AxisPlant
from .judging.agreeing import merge
from .judging.external import add_external
from .judging.ruling import WITNESS, rule_by_balance
from .judging.ruling import gain as of_balance
from .reading import ripple, stamps
from .simulating.closed_loop import closed_loop
from .telling.dropped import list_dropped
from .telling.next_records import next_records
from .telling.plausible import describe as electrical
from .telling.plausible import find_implausible

MOVED = 0.02  # of the plant file's friction: less is not worth a word


def discrepancy(
    plant_file: Path, records: Sequence[Record], say: Progress
) -> tuple[shared.Findings, Callable[[], list[Picture]]]:
    """Findings on records of the axis in `plant_file`, and what draws their pictures."""
    from .telling.pictures import pictures

    plant = AxisPlant(axis_config.load(plant_file), records)
    outcome = examine_ways(plant, say)
    return findings(plant, outcome), lambda: pictures(plant, outcome)


def findings(plant: AxisPlant, outcome: Outcome) -> shared.Findings:
    """Findings as every plant reports them."""
    gain = shared.Gain(
        *outcome.train,
        outcome.folds.err_before,
        outcome.folds.err_after,
        outcome.folds.noise_floor,
        tuple(outcome.k_before),
        tuple(outcome.k_after),
        k_interval=tuple(
            (k - shared.WITHIN * sd, k + shared.WITHIN * sd)
            for k, sd in zip(outcome.k_after, outcome.k_error, strict=False)
        ),
        k_names=tuple(outcome.base),
        what="error of the free run over the record's own size",
        scale=100.0,
        unit="%",
        folds=outcome.folds,
        residual=outcome.left.residual,
    )
    structure = dict(outcome.structure)
    if structure:
        structure["sentences"] = [term["sentence"] for term in structure.get("terms", ())]
        structure["sentences"] += [structure["event"]] if "event" in structure else []
    if rippled := ripple.structure(plant):
        structure |= {**rippled, "sentences": [*structure.get("sentences", []), *rippled["sentences"]]}
    notes = [*outcome.notes]
    if outcome.verdict != "adequate":
        notes.append(f"the nominal model is refuted: {outcome.because} (p = {outcome.p_value:.1g})")
    said = _balance(plant, outcome)
    rules = rule_by_balance(plant, outcome)
    if rules is not None and plant.balance is not None:
        found, verdict = rules.effects, grade(rules.left, named=bool(rules.effects))
        by_balance: Balance | None = plant.balance
        gain = of_balance(plant, plant.balance, rules.left, outcome)
        notes, structure = [rules.note, *(note for note in notes if note in SAID.values())], {}
    else:
        follows = outcome.folds.noise_floor <= WITNESS
        told_by_runs = [_effect(e) for e in outcome.effects]
        found, by_balance = merge(plant, told_by_runs, outcome.verdict, outcome.point, follows=follows)
        verdict = grade(outcome.left, named=True) if by_balance is not None else outcome.verdict
    by_runs = rules is None and by_balance is None
    found = add_external(plant, found)
    if by_runs and "free_run" in said:
        said["free_run"]["answer"] = outcome.folds.err_after
    notes += sentences(said) if said else ["no stretch of motion is long enough for a regression on the balance"]
    notes += [f"implausible: {text}" for text in find_implausible(plant, outcome)]
    moved = _moved(plant, outcome) if rules is None else {}
    notes += [_say_moved(moved)] if moved else []
    notes += _kinds(plant) + list(ripple.describe(plant)) + _zeros(plant, outcome)
    return shared.Findings(
        verdict,
        found,
        gain,
        structure,
        outcome.tried,
        notes,
        [asdict(r) for r in outcome.records],
        _fitted(plant, outcome) if by_balance is None else _by_balance(plant, by_balance),
        rest=outcome.rest if rules is None else rules.rest,
        rejected=_rejected(plant, outcome, {name for e in found for name in (e.name, *e.indistinguishable_from)}),
        posterior=outcome.posterior if by_runs else [],
        balance=said,
        moved=moved,
    )


def _rejected(plant: AxisPlant, outcome: Outcome, named: set[str]) -> list[dict[str, Any]]:
    """What lost to the answer, in nats; and what fits clearly better beside it and is no cause."""
    better = list_dropped(plant, outcome, named)
    there = {row["name"] for row in better}
    return [*better, *(row for row in outcome.lost if row["name"] not in there | named)]


def _balance(plant: AxisPlant, outcome: Outcome) -> dict[str, Any]:
    """The regression on the balance; empty where no stretch of motion is long enough."""
    found, linear = plant.balance, plant.plant.is_linear
    if found is None:
        return {}
    out = describe(found, linear=linear)
    if asked := next_records(out):
        out["next"] = asked
    if seen := electrical(plant):
        out["electrical"] = seen
    if found.given or not all(effects(found, term) for term in found.terms):
        return out  # a law that the axis model does not simulate: free runs say nothing of it
    run = plant.errors(point(found, linear=linear), range(len(plant.blocks)))
    out["free_run"] = {"err": run.error, "noise_floor": run.noise_floor}
    nominal = closed_loop(plant, dict(zip(outcome.base, outcome.k_before, strict=True)))
    extended = closed_loop(plant, point(found, linear=linear))
    if nominal is not None and extended is not None:
        out["closed_loop"] = {
            name: {"before": getattr(nominal, name), "after": getattr(extended, name)} for name in ("position", "drive")
        }
    return out


def _by_balance(plant: AxisPlant, b: Balance) -> dict[str, Any]:
    """Base parameters as the balance has them, where it adds effects that free runs had terms without a name for."""
    own = point(b, linear=plant.plant.is_linear)
    kept = ["F_d", *(name for name in ("J", "M", "C") if name in plant.plant.fitted)]
    return {name: float(f"{own[name]:.6g}") for name in kept if name in own}


def _moved(plant: AxisPlant, outcome: Outcome) -> dict[str, Any]:
    """Friction that was fitted away from the plant file's, and what it may stand for (`Findings.moved`)."""
    before, after, error = plant.plant.F_d, outcome.point["F_d"], outcome.k_error[outcome.base.index("F_d")]
    if abs(after - before) < max(3.0 * error, MOVED * before):
        return {}
    unit = "N" if plant.plant.is_linear else "N m"
    said = f"dry friction was fitted as {after:.3g} {unit}, the plant file says {before:.3g}"
    return {"said": said, "alike": list(outcome.mimicked)}


def _say_moved(moved: dict[str, Any]) -> str:
    if not moved["alike"]:
        return str(moved["said"])
    how = dict.fromkeys(registry()[name].separated_by for name in moved["alike"])
    others = " or ".join(moved["alike"])
    return f"{moved['said']}; on these records {others} would look the same, to be told apart by {'; '.join(how)}"


def _effect(e: dict[str, Any]) -> shared.FoundEffect:
    parameters = {name: shared.Quantity(**q) for name, q in e["parameters"].items()}
    others = tuple(e["indistinguishable_from"])
    place = registry()[e["name"]].place if e["name"] in registry() else "plant"
    said = (e["sentence"], e["separated_by"])
    return shared.FoundEffect(e["name"], e["confidence"], others, parameters, *said, place, of_others=e["of_others"])


def _kinds(plant: AxisPlant) -> list[str]:
    """What was taken for granted about each record."""
    out = []
    for b, record in zip(plant.benches, plant.records, strict=True):
        noise = ", ".join(
            f"{name} {n.sigma:.2g}"
            + (f" and {n.jitter:.2g} s of sampling time" if n.jitter > 1e-6 and not b.static else "")
            for name, n in b.noise.items()
            if not n.declared
        )
        more = f"; {b.roles.derived} repeats {b.roles.position} and is not compared" if b.roles.derived else ""
        how = "at standstill" if b.static else f"driven by {b.roles.drive} in windows of {b.windows[0].n} samples"
        out.append(f"{b.name}: {how}" + (f"; noise estimated: {noise}" if noise else "") + more)
        channel = b.roles.position or b.roles.speed
        if channel and not b.static:
            out += stamps.describe(b.name, record.cycles, channel)
    return out


def _zeros(plant: AxisPlant, outcome: Outcome) -> list[str]:
    """Where the angle zeros of records given together lie."""
    out = []
    for name, zero in plant.zeros.items():
        if zero.angle is None:
            out.append(
                f"{name}: no torque locked to the angle stands out, its angle zero is taken to be that of the others"
            )
        elif zero.turned:
            orders = ", ".join(f"{n:g}" for n in zero.turned)
            out.append(
                f"{name}: the torque of order {orders} has the other sign than in the records before, as by a "
                "neighbour's magnets or a current sensor; "
                + (
                    "no other zero of the angle turns these and leaves the rest"
                    if zero.instead is None
                    else f"a zero {zero.instead:+.4g} rad off would look the same"
                )
            )
        elif zero.angle:
            orders = ", ".join(f"{n:g}" for n in zero.orders)
            other = f", or by multiples of {zero.period:.4g} rad more" if zero.period < 6.0 else ""
            out.append(
                f"{name}: angles are {outcome.point[f'zero:{name}']:+.4g} rad off (torque of order {orders}{other})"
            )
    return out


def _fitted(plant: AxisPlant, outcome: Outcome) -> dict[str, Any]:
    """Base parameters as fitted, and unnamed terms, for extended.yaml."""
    point = outcome.point
    base = [f.name for f in plant.base if not f.name.startswith("zero:")]  # a zero is the record's, not the plant's
    out: dict[str, Any] = {name: float(f"{point[name]:.6g}") for name in base}
    p = plant.plant
    if p.F_s is not None and p.F_d > 0.0:  # static friction keeps its ratio, as it did in the fit
        out["F_s"] = float(f"{p.F_s / p.F_d * point['F_d']:.6g}")
    terms = [term["values"] for term in outcome.structure.get("terms", [])]
    if terms:
        out["structure"] = [*p.structure, *({k: float(v) for k, v in t.items()} for t in terms)]
    return out
