"""On which grid the comparators of the record switch: a condition of the bench, not a fault and not an effect.

A hysteresis comparator that is evaluated every Δt switches late by Δt/2 on average, which shifts local means of the
current by up to a quarter of (slope × Δt), alike in every cycle. None of the nominal steps may come near it. So where
the nominal ones leave a rest, others are tried on the model as it is; and near the truth the pattern of the currents
tells the step, however fine.

Legs that follow late by a time of their own do nearly the same (`comparator_delay`), and that is an effect: where a
record tells a step coarser than the usual ones, either is fitted, and the likelier taken.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.actuator.simulating.plant import NOISE_STEPS, STEPS, EmaPlant, dividing
from ema.discrepancy.plant import Point

from .fit import excess_at, misfit_at

# [s] roughly: a whole number makes a control period
TRIED = (2.5e-7, 5e-7, 1e-6, 1.5e-6, 2e-6, 3e-6, 4e-6, 5e-6, 7e-6, 1e-5, 1.4e-5, 2e-5)
COARSELY = (5e-7, 2e-6, 5e-6, 1.4e-5)  # [s] of these: where none leaves less, none between them does
FINE = (2.5e-7, 5e-7, 1e-6, 2e-6)  # [s] of those that leave no rest by themselves
NATS = 10.0  # by which a step has to be likelier than the usual ones
FELT = 0.05  # difference in misfit; less is chance
AROUND = (1.0, 1.25, 0.8)  # times the step, for the noise: what is left unknown of it
CLEAR = 0.7  # share of what is left that another step may leave to be taken instead
PLAIN = 0.3  # the same where effects have not been looked for: no other flaw goes below 0.75, a coarse step to 0.2
LATE = "comparator_delay"  # the effect that a coarser step can stand for
DELAYS = (0.25, 0.5, 1.0, 2.0)  # times that step, from which its fit may begin; a step makes legs late by half of it


def find_step(plant: EmaPlant, noise: Noise, point: Point, cycles: Sequence[int], share: float) -> float | None:
    """The integration step with which `point` leaves less than a share of what is left now, None without one. [s]"""
    now = excess_at(plant, noise, point, cycles)
    if now < FELT:
        return None
    left = {step: excess_at(plant, noise, point, cycles, (step,)) for step in _steps(plant, COARSELY)}
    if min(left.values()) > now - FELT:  # what a step makes of a record grows with it, and evenly
        return None
    left |= {step: excess_at(plant, noise, point, cycles, (step,)) for step in _steps(plant, TRIED) if step not in left}
    best = max(step for step, x in left.items() if x < min(left.values()) + FELT)  # the coarser, the cheaper
    return best if left[best] < min(share * now, now - FELT) else None


def tell_step(plant: EmaPlant, noise: Noise, point: Point, cycles: Sequence[int]) -> float | None:
    """The step with which `point` is likeliest, None where the usual ones do as well. [s]"""
    now = misfit_at(plant, noise, point, cycles)
    left = {step: misfit_at(plant, noise, point, cycles, (step,)) for step in _steps(plant, FINE)}
    best = min(left, key=lambda step: left[step])
    return best if 0.5 * (now - left[best]) * noise.expected(cycles) > NATS else None


def is_coarse(step: float) -> bool:
    """Whether legs switch later with this step than with the usual ones."""
    return step > max(STEPS)


def is_finest(plant: EmaPlant, step: float) -> bool:
    """Whether none finer was tried: the record's comparators may act at no clock at all."""
    return step == dividing(plant.plant, min(TRIED))


def find_delay(plant: EmaPlant, noise: Noise, point: Point, cycles: Sequence[int], step: float) -> Point:
    """`point` with the delay that is likeliest by the usual steps, of those that a coarser step can stand for."""
    name = f"{LATE}.time"
    late = [{**point, name: plant.neutral(name) + share * step} for share in DELAYS]
    return min(late, key=lambda there: misfit_at(plant, noise, there, cycles, STEPS))


def weigh_delay(
    plant: EmaPlant, noises: Sequence[Noise], late: Point, stepped: Point, step: float, cycles: Sequence[int]
) -> float:
    """By how much `late` by the usual steps is likelier than `stepped` by a coarser one, over noises. [nats]"""
    more = (misfit_at(plant, n, stepped, cycles, (step,)) - misfit_at(plant, n, late, cycles, STEPS) for n in noises)
    return float(np.mean([0.5 * x * n.expected(cycles) for x, n in zip(more, noises, strict=True)]))


def take_step(plant: EmaPlant, step: float | None) -> None:
    """Simulate with this step from now on, and where noise is asked for with its neighbours; None: with the usual."""
    plant.step = step
    plant.steps = STEPS if step is None else (step,)
    plant.noise_steps = (
        NOISE_STEPS if step is None else tuple(dividing(plant.plant, step * factor) for factor in AROUND)
    )


def _steps(plant: EmaPlant, about: Sequence[float]) -> list[float]:
    return [dividing(plant.plant, step) for step in about]
