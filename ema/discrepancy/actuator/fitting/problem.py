"""The actuator with its record, as the engine asks for it: features, faults, a cause and its prior."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from ema.core.names import FAULTS
from ema.core.records import Array
from ema.discrepancy.actuator.simulating.plant import EmaPlant
from ema.discrepancy.engine.hypothesis import Block, Cause, Parameter, Point
from ema.discrepancy.engine.posterior import PRIOR, log_prior
from ema.effects import registry

from .candidates import Candidate

K_USUAL = 0.05  # of a fault that is worth an alarm
K_MOST = 0.6  # a larger fault is no wear any more


class ActuatorProblem:
    """What the engine may ask of an actuator's record.

    Parameters
    ----------
    plant : EmaPlant
        Under the conditions of the record.
    """

    def __init__(self, plant: EmaPlant):
        self.plant = plant
        data = plant.data
        self.grids = len(plant.noise_steps)
        self.cycles = list(range(data.n_cycles))
        sizes = np.cumsum([0, *(len(data.y[c]) for c in self.cycles)])
        self.at = [slice(int(a), int(b)) for a, b in itertools.pairwise(sizes)]
        self.blocks = [Block(at, int(data.motion[c])) for at, c in zip(self.at, self.cycles, strict=True)]
        self.measured = np.concatenate(data.y)
        self.floors = np.concatenate([plant.floors[int(data.motion[c])] for c in self.cycles])
        self.faults = tuple(Parameter(name, 0.0, K_MOST, K_USUAL) for name in FAULTS)

    def records(self, points: Sequence[Point], seeds: range) -> Array:
        """Features of simulated records: all cycles of one have one step of the comparators."""
        steps = self.plant.noise_steps
        runs = self.plant.repeated(points, self.cycles, len(seeds), seeds.start, steps)
        return np.array([np.concatenate([at[c].features for c in self.cycles], axis=1) for at in runs])


def as_cause(tried: Candidate) -> Cause:
    """An effect as it was tried, with sizes as usual as the effect declares."""
    effect = registry()[tried.effect]
    declared = {p.name: p for p in effect.parameters}
    parameters = []
    for free in tried.frees:
        p = declared[free.name.split(".")[1]]
        neutral = tried.fixed.get(p.name, p.neutral)
        usual = abs(p.start - neutral) or 0.1 * (free.high - free.low)
        parameters.append(Parameter(free.name, free.low, free.high, usual, neutral))
    return Cause(effect.name, tuple(parameters), PRIOR)


def cost_of(tried: Candidate, sd: Mapping[str, float]) -> float:
    """By how much likelier a record must be with an effect than without, for it to be as likely as not. [nats]

    An effect is rarely there, and a parameter that the record tells to `sd` might have had any usual size.
    """
    cause = as_cause(tried)
    sizes = (p.usual / max(sd[p.name], 1e-300) for p in cause.parameters)
    return sum(max(float(np.log(size)), 0.0) for size in sizes) - log_prior((cause,))
