"""Verdicts made sure: by more runs, at the true minimum, under the conditions that the record seems to have."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ema.discrepancy.actuator.fitting.candidates import candidates
from ema.discrepancy.actuator.fitting.comparators import (
    CLEAR,
    LATE,
    NATS,
    PLAIN,
    find_delay,
    find_step,
    is_coarse,
    take_step,
    tell_step,
    weigh_delay,
)
from ema.discrepancy.actuator.fitting.model import CHANCE, DISTANT, Model
from ema.discrepancy.actuator.fitting.problem import cost_of
from ema.discrepancy.actuator.fitting.timing import find_samples_late
from ema.discrepancy.actuator.fitting.zeros import find_zero, take_zero
from ema.discrepancy.actuator.simulating.noise import N_RUNS, N_RUNS_SURE, Noise, Verdict

from .weighing import is_credible

if TYPE_CHECKING:
    from ema.discrepancy.actuator.fitting.search import Search

FAULT_ALARM = 0.02  # a fault that an operator would be told of
PHASES = ("_a", "_b", "_c")
NEARLY = 0.5  # excess of a model that may be the right one but for switching


def judge_closely(search: Search, model: Model, v: Verdict) -> tuple[Model, Verdict]:
    """The verdict, in a close case by a null distribution from more runs and by another step of the comparators."""
    if v.is_noise or model.excess > NEARLY:
        return model, v
    search.noise = Noise(search.plant, model.fit.point, N_RUNS_SURE)
    v = search.verdict(model)
    return (model, v) if v.is_noise else take_bench_conditions(search, model, v, PLAIN)


def take_bench_conditions(search: Search, model: Model, v: Verdict, share: float = CLEAR) -> tuple[Model, Verdict]:
    """`model` with the zeros, command and grid of comparators that the record seems to have, if others than ours."""
    model, v = _take_zeros(search, model, v)
    if v.is_noise:
        return model, v
    late = find_samples_late(search.plant, search.noise, model.fit.point, search.train)
    if late:
        search.plant.late = late
        model = search.model(model.effects, model.fit.free, model.fit.point, None, 3)
        v = search.verdict(model)
        search.say(f"command {late:+d} samples late: p = {v.p_value:.2g}")
        if v.is_noise:
            return model, v
    step = find_step(search.plant, search.noise, model.fit.point, search.train, share)
    if step is None:
        return model, v
    return _by_step(search, model, step, N_RUNS_SURE)


def _take_zeros(search: Search, model: Model, v: Verdict) -> tuple[Model, Verdict]:
    """`model` with the zeros of rotor and user as far apart as it leaves them, unless that leaves more."""
    zero, taken = find_zero(search.plant, model.fit.point, search.train), search.plant.data.zero
    if zero is None:
        return model, v
    take_zero(search.plant, zero)
    made = search.model(model.effects, model.fit.free, model.fit.point, None, 3)
    if made.excess > model.excess:
        take_zero(search.plant, taken)
        return model, v
    v = search.verdict(made)
    search.say(f"zeros of rotor and user {zero:+.2g} rad apart: p = {v.p_value:.2g}")
    return made, v


def settle_at_minimum(search: Search, model: Model, v: Verdict, alike: list[tuple[str, ...]]) -> tuple[Model, Verdict]:
    """`model` with faults and effects told apart that look nearly the same, as far as the record allows.

    Legs that follow late come as an effect of their own, with nothing in `alike`.
    """
    if not model.effects or model.excess > DISTANT or search.is_settled(model):
        return model, v
    model, v = _take_zeros(search, model, v)
    model, v = _at_the_minimum(search, *_by_its_own_step(search, *begin_again(search, model, v), alike))
    search.minima.append((model.fit, search.noise))
    return model, v


def _by_its_own_step(search: Search, model: Model, v: Verdict, alike: list[tuple[str, ...]]) -> tuple[Model, Verdict]:
    """`model` with the step of the comparators that the record tells near the truth, and with late legs if likelier.

    A step with which more than noise is left stands for what is missing, and hides it: it is not taken.
    """
    step = tell_step(search.plant, search.noise, model.fit.point, search.train) if search.plant.step is None else None
    if step is None:
        return model, v
    usual, late = search.noise, _with_late_legs(search, model, step)
    stepped, w = _by_step(search, model, step, N_RUNS)
    if late is None or not _is_likelier(search, late, stepped, step, usual):
        if w.is_noise:
            return stepped, w
        take_step(search.plant, None)
        search.noise = usual
        return model, v
    take_step(search.plant, None)
    search.noise = Noise(search.plant, late.fit.point)
    late = search.model(late.effects, late.fit.free, late.fit.point, None, 2)
    alike.append(())
    return _by_its_own_step(search, late, search.verdict(late), alike)


def _with_late_legs(search: Search, model: Model, step: float) -> Model | None:
    """`model` with legs that follow late and the usual steps, None where these cannot stand for `step`."""
    if not is_coarse(step) or LATE in model.names or model.is_full:
        return None
    c = next((c for c in candidates(search.plant.plant, search.plant.data, []) if c.effect == LATE), None)
    if c is None:
        return None
    start = find_delay(search.plant, search.noise, model.fit.point, search.train, step)
    late = search.model((*model.effects, c), (*model.fit.free, *c.frees), start, model.fit.columns, 4)
    return late if is_credible(late) else None


def _is_likelier(search: Search, late: Model, stepped: Model, step: float, usual: Noise) -> bool:
    """Whether legs that follow late are clearly likelier than a coarser step, which needs no cause."""
    points = late.fit.point, stepped.fit.point
    nats = weigh_delay(search.plant, (usual, search.noise), *points, step, search.train)
    nats -= cost_of(late.effects[-1], late.fit.sd)
    time = late.fit.point[f"{LATE}.time"]
    search.say(f"legs {1e6 * time:.2g} µs late instead: {nats:+.0f} nats")
    return nats > NATS


def _by_step(search: Search, model: Model, step: float, n_runs: tuple[int, int]) -> tuple[Model, Verdict]:
    """`model` fitted anew with this step of the comparators, by noise of so many runs."""
    take_step(search.plant, step)
    search.noise = Noise(search.plant, model.fit.point, n_runs)
    model = search.model(model.effects, model.fit.free, model.fit.point, None, 2)
    v = search.verdict(model)
    search.say(f"comparators every {1e6 * step:g} µs: p = {v.p_value:.2g}")
    return model, v


def _at_the_minimum(search: Search, model: Model, v: Verdict) -> tuple[Model, Verdict]:
    found = search.settled(model)
    if found.heldout <= model.heldout + CHANCE:
        return found, search.verdict(found)
    sd = {name: max(x, found.fit.sd[name]) for name, x in model.fit.sd.items()}  # the record tells no better
    return replace(model, fit=replace(model.fit, sd=sd)), v


def begin_again(search: Search, model: Model, v: Verdict) -> tuple[Model, Verdict]:
    """`model`, or where that leaves less, fitted anew from sensors whose gains (or offsets) have nothing in common.

    Sensors that all read too high, and a lighter rotor with less drag and friction, balance the torque alike. A ridge
    lies between them, and a fit stays on the side where faults had led it.
    """
    for effect in model.effects:
        names = [f"{effect.effect}.{name}" for name in effect.linear if name.endswith(PHASES)]
        if len(names) == len(PHASES):
            common = float(np.mean([model.fit.point[name] for name in names]))
            start = {**model.fit.point, **{name: model.fit.point[name] - common for name in names}}
            made = search.model(model.effects, model.fit.free, start, None, 6)
            if search.left_more(made, model, (search.noise,)) < -CHANCE:
                search.say(f"{effect.effect} without {common:.2g} in all phases leaves less")
                return made, search.verdict(made)
    return model, v
