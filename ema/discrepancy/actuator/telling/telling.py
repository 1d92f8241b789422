"""What is told of a model: effects with intervals and odds, structure, gain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ema.core.names import FAULTS
from ema.discrepancy.actuator.finding.verdicts import FAULT_ALARM
from ema.discrepancy.actuator.finding.weighing import WORTH_IT, is_enough
from ema.discrepancy.actuator.fitting.fit import SEED, Fit
from ema.discrepancy.actuator.fitting.leave_out import over_folds, square
from ema.discrepancy.actuator.fitting.model import CHANCE, FINAL_SEED, N_FINAL, Model
from ema.discrepancy.actuator.reading import controller
from ema.discrepancy.actuator.reading.structure import structure
from ema.discrepancy.actuator.scoring.entrants import describe_posterior, probabilities
from ema.discrepancy.actuator.simulating.noise import SEED as NOISE_SEED
from ema.discrepancy.actuator.simulating.noise import Verdict
from ema.discrepancy.engine.contest import Outcome
from ema.discrepancy.findings import WITHIN, Findings, FoundEffect, Gain, Quantity, reject
from ema.discrepancy.grade import UNSOLVED
from ema.discrepancy.plant import Point
from ema.effects import registry

from . import repeating
from .extension import write_extension
from .intervals import FORM, hold_rest, of_faults
from .remains import Remains, remains

if TYPE_CHECKING:
    from ema.discrepancy.actuator.fitting.search import Search

MOST_OF_IT = 0.95  # share of what faults alone leave that effects must explain to be named beside an unexplained rest
UNCERTAIN_LAW = 0.85  # of a confidence where it may be another law altogether: what is left is no chance
IN_LIBRARY = 0.99  # probability that what does it is in the library at all, where it leaves nothing
LOUD, MOST = 1.3, 0.5  # misfit of a cycle that shows a rest; share of it that is worth a word
SEEDS = {"noise": NOISE_SEED, "fit": SEED, "held out": FINAL_SEED}  # the first of each
OF_NATS = {"evidence": "the evidence of the record", "held-out cycles": "what held-out cycles say"}
NON_INTEGER = 0.06  # distance of an order from the next integer from which it is none


def write_findings(
    search: Search,
    before: Model,
    after: Model,
    v: Verdict,
    alike: list[tuple[str, ...]],
    outcome: Outcome,
    least_sd: Mapping[str, float],
) -> Findings:
    """The verdict on `after`, with its effects and their rivals `alike`, structure, gain over `before`, notes.

    `outcome` holds the probabilities and sizes of all that was weighed, `least_sd` what parameters are not known
    better than, whatever the score says.
    """
    torque_lines = [c for c in after.effects if c.effect in ("cogging", "torque_line")]
    odd = [c for c in torque_lines if not _integer(after.fit, c.effect)]
    further = [c for c in torque_lines if c.effect == "torque_line" and not odd]
    kept = [(c, a) for c, a in zip(after.effects, alike, strict=False) if c.effect != "torque_line" and c not in odd]
    left = after.excess / max(before.excess, 1e-9)
    share = 1.0 - left
    is_beside = bool(odd) or not (v.is_noise or is_enough(after, before))  # of a rest that nothing explains
    too_little = is_beside and share < MOST_OF_IT
    made = remains(search, before, after, v, odd, named=bool(kept) and not too_little)
    notes: list[str] = []
    shape: dict[str, Any] = {}
    if odd or not v.is_noise:
        base = Model((), before.fit, before.heldout) if odd or too_little else after  # beside what is named
        shape = structure(search.torques(base), search.plant.plant.control.rate, v.scores)
        signals = search.plant.data.signals
        shape["sentences"] += controller.describe_gains(search.plant.plant, signals)
        rests = [(signals[c], r) for c, r, _ in search.rests(base, "control")]
        if of_error := controller.fit_function_of_error(search.plant.plant, rests):
            shape["controller"] = of_error
            shape["sentences"] += controller.describe_function_of_error(of_error)
        shape["sentences"] += repeating.describe(repeating.repeating(search, base.fit.point))
    if made.is_little and not made.left.is_chance:
        notes.append(f"{made.left.sentence} (p = {v.p_value:.1g})")
    if not search.plant.data.has_temperature:
        notes.append("no winding temperature (temp_w) was recorded: effects of temperature are seen as constant")
    rest = 0.0 if v.is_noise else float(np.sqrt(max(left, _left_in_training(before, after))))
    found = [_describe_effect(after, c.effect, a, rest, outcome, least_sd) for c, a in kept]
    if odd or not v.is_noise or made.verdict in UNSOLVED:
        found = [replace(e, confidence=UNCERTAIN_LAW * e.confidence) for e in found]
    if is_beside:
        notes += _recorded_once(search, after)
    if too_little and found:
        notes.append(
            f"{', '.join(e.name for e in found)} would explain {share:.0%} of the rest: too little to be named"
        )
        found = []
    for c in odd:
        at, amplitude = (after.fit.point[f"{c.effect}.{name}"] for name in ("order", "amplitude"))
        notes.append(f"a torque line at the non-integer order {at:.4g} is no cogging of this motor")
        shape["orders"] = [{"order": at, "amplitude": amplitude, "share": 1.0 - after.excess / before.excess}]
        shape["sentences"] = [f"a torque line of {amplitude:.2g} N m at {at:.4g} periods per rotor turn"]
    tried = [
        {"name": " + ".join(m.names) or "faults only", "score": -m.heldout}
        for m in sorted(search.tried, key=lambda m: m.heldout)
    ]
    lines = [c for c in (*odd, *further) if c in made.model.effects]
    unnamed = [_describe_effect(after, c.effect, (), rest, outcome, least_sd, "torque_line") for c in lines][:1]
    if further and unnamed:
        values = {name: q.value for name, q in unnamed[0].parameters.items()}
        unnamed = [replace(unnamed[0], sentence=f"a further {registry()['cogging'].said(values)}")]
        notes.append(f"beside it stands {unnamed[0].sentence}")
    return Findings(
        made.verdict, found, _gain(search, before, made.model, v, made, outcome), shape, tried, notes,
        unnamed=unnamed, posterior=describe_posterior(outcome),
        rejected=describe_rejected(search, before, after, outcome), seeds=SEEDS,
        rest=0.0 if made.left.is_chance else made.left.residual.rest,
    )  # fmt: skip


def describe_rejected(search: Search, before: Model, after: Model, outcome: Outcome) -> list[dict[str, Any]]:
    """Sets of causes that were fitted and are not the answer: how much less likely, and what they leave.

    By the evidence of the record where a set was weighed so, else by held-out cycles, where both were judged by one
    noise.
    """
    best: dict[frozenset[str], Model] = {}
    for m in search.tried:
        key = frozenset(m.names)
        if m.effects and key != frozenset(after.names) and m.heldout < best.get(key, m).heldout + 1e-12:
            best[key] = m
    weighed = {frozenset(w.entrant.names): w for w in outcome.weighed}
    answer, own = " + ".join(after.names) or "faults alone", weighed.get(frozenset(after.names))
    rows = []
    for key, m in sorted(best.items(), key=lambda item: item[1].heldout):
        nats = error = of = None
        if own is not None and key in weighed:
            nats, error = own.log_evidence - weighed[key].log_evidence, float(np.hypot(own.error, weighed[key].error))
            of = "evidence"
        elif m.by is not None and m.by is after.by:
            nats, of = 0.5 * (m.heldout - after.heldout) * m.by.expected(search.heldout), "held-out cycles"
        lost = f"{_behind(nats, error)} {answer} by {OF_NATS[of]}; " if nats is not None and of else ""
        why = f"{lost}leaves {m.heldout:.3g} of held-out cycles where noise is 1; {answer}: {after.heldout:.3g}"
        rows.append(reject(" + ".join(sorted(m.names)), before.heldout, m.heldout, why, (nats, error), of))
    return rows


def _behind(nats: float, error: float | None) -> str:
    about = f" ± {error:.1f}" if error else ""
    return f"{abs(nats):.1f}{about} nats {'behind' if nats >= 0.0 else 'before'}"


def _recorded_once(search: Search, model: Model) -> list[str]:
    """A rest that only motions show of which no cycle could be held out, and what would take it there."""
    data, held = search.plant.data, {int(search.plant.data.motion[c]) for c in search.heldout}
    loud = [c for c in search.train if search.noise.misfit([model.fit.residuals[c]], [c]) > LOUD]
    if model.excess > CHANCE or not loud or any(int(data.motion[c]) in held for c in loud):
        return []
    best = min(
        (m for m in search.tried if len(m.effects) > len(model.effects)), key=lambda m: m.fit.misfit, default=model
    )
    share = 1.0 - _left_in_training(model, best)
    perhaps = f" ({' + '.join(best.names)} would take {share:.0%} of it)" if share > MOST else ""
    where = ", ".join(data.labels[c] for c in loud)
    return [
        f"what is left{perhaps} shows only in {where}: a motion recorded once, so that no cause could be tried on a "
        "cycle that it was not fitted to; record it again"
    ]


def _left_in_training(before: Model, after: Model) -> float:
    """Share of what there was beyond noise in training cycles that is left."""
    return max(after.fit.misfit - 1.0, 0.0) / max(before.fit.misfit - 1.0, 1e-9)


def try_as_function(search: Search, findings: Findings, before: Model, after: Model) -> tuple[Findings, Model]:
    """What the structure says as a function, simulated: part of the extended plant if held-out cycles gain by it."""
    if "controller" in findings.structure:
        return findings, after  # a torque would stand in for it
    base = Model((), before.fit, before.heldout)
    for effect, values in write_extension(findings.structure).items():
        table = {f"{effect}.{name}": value for name, value in values.items()}
        m = search.model((), base.fit.free, {**base.fit.point, **table}, None, 4)
        if base.excess - m.excess < WORTH_IT * base.excess:
            continue
        error, _ = over_folds(search, before, m)
        if error.gain <= 0.0:
            continue  # less is left of the rest, and more of the currents
        e = registry()[effect]
        quantities = {p.name: Quantity(values[p.name], values[p.name], values[p.name], p.unit) for p in e.parameters}
        unnamed = [FoundEffect(effect, 0.0, (), quantities, e.said(values), e.separated_by, e.place)]
        share = 1.0 - m.excess / base.excess
        findings.structure["sentences"].append(f"{e.said(values)}, takes {share:.0%} of the rest")
        k_after = tuple(round(m.fit.point.get(n, 0.0), 5) for n in FAULTS)
        after_it = replace(
            findings.gain,
            train_after=_envelope_error(search, m.fit.point, search.train),
            heldout_after=error.err_after,
            noise_floor=error.noise_floor,
            k_after=k_after,
            k_interval=(),
            false_alarms_after=sum(x > FAULT_ALARM for x in k_after),
            folds=error,
        )
        return replace(findings, unnamed=unnamed, gain=after_it), m
    return findings, after


def _integer(fit: Fit, line: str) -> bool:
    order = fit.point[f"{line}.order"]
    sd = fit.sd[f"{line}.order"]
    return abs(order - round(order)) < max(NON_INTEGER, 3.0 * sd)


def _describe_effect(
    model: Model,
    effect: str,
    alike: tuple[str, ...],
    rest: float,
    outcome: Outcome,
    least_sd: Mapping[str, float],
    told_as: str = "",
) -> FoundEffect:
    """What was fitted as `effect`, told as that or as another effect with the same parameters.

    With the probability, the sizes and the intervals that all sets of causes together give it.
    `rest` is the amplitude of what is left above noise over that of what there was.
    """
    e = registry()[told_as or effect]
    bounds = {f.name: f for f in model.fit.free}
    values = {p.name: model.fit.point.get(f"{effect}.{p.name}", p.neutral) for p in e.parameters}
    sizes = outcome.sizes(effect)
    parameters = {}
    for p in e.parameters:
        name = f"{effect}.{p.name}"
        if name in bounds:
            value, own = sizes[name]
            parts = [max(own, least_sd.get(name, 0.0)), FORM * rest * value]
            sd = float(np.linalg.norm([*parts, e.least_sd.get(p.name, 0.0)]))
            f = bounds[name]
            values[p.name] = value
            parameters[p.name] = Quantity(
                value, max(value - WITHIN * sd, f.low), min(value + WITHIN * sd, f.high), p.unit
            )
    own, *others = (IN_LIBRARY * p for p in probabilities(outcome, model, effect, *alike))
    return FoundEffect(e.name, own, alike, parameters, e.said(values), e.separated_by, e.place, of_others=sum(others))


def _envelope_error(search: Search, point: Point, cycles: list[int]) -> float:
    """Rms of measured less mean simulated envelope over cycles. [A]"""
    runs = search.plant.repeated([point], cycles, N_FINAL, FINAL_SEED)[0]
    return float(np.sqrt(np.mean([square(search.plant, c, runs[c].envelopes.mean(axis=0)) for c in cycles])))


def _gain(search: Search, before: Model, after: Model, v: Verdict, made: Remains, outcome: Outcome) -> Gain:
    faults = of_faults(after, outcome)
    if not v.is_noise:
        faults = hold_rest(search, after, faults)
    k_after = tuple(round(faults[n].value, 5) for n in FAULTS)
    k_before = k_after if after.fit is before.fit else tuple(round(before.fit.point.get(n, 0.0), 5) for n in FAULTS)
    ends = ((of.value - WITHIN * of.sd, of.value + WITHIN * of.sd) for of in faults.values())
    return Gain(
        _envelope_error(search, before.fit.point, search.train),
        _envelope_error(search, after.fit.point, search.train),
        made.error.err_before,
        made.error.err_after,
        made.error.noise_floor,
        k_before,
        k_after,
        sum(x > FAULT_ALARM for x in k_before),
        sum(x > FAULT_ALARM for x in k_after),
        tuple((max(low, 0.0), min(high, 1.0)) for low, high in ends),
        folds=made.error,
        residual=made.left.residual,
    )
