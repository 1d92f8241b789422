"""The actuator with its record, as the engine asks for it: features, faults, causes and their priors."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from ema.core.names import FAULTS
from ema.discrepancy.engine.hypothesis import Block, Cause, Parameter, Point
from ema.effects import registry

from .candidates import Candidate, candidates
from .features import Array
from .free import K_STEP
from .plant import EmaPlant

K_USUAL = 0.05  # of a fault that is worth an alarm
K_MOST = 0.6  # a larger fault is no wear any more
PRIOR = 0.02  # probability that one given effect is there; some thirty make one cause likely in every other record


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
        self.faults = tuple(Parameter(name, 0.0, K_MOST, K_USUAL, K_STEP) for name in FAULTS)

    @cached_property
    def causes(self) -> tuple[Cause, ...]:
        """Every effect that can be tried without having looked at a residual."""
        tried: dict[str, list[Candidate]] = {}
        for c in candidates(self.plant.plant, self.plant.data, ()):
            tried.setdefault(c.effect, []).append(c)
        return tuple(as_cause(of) for of in tried.values())

    def records(self, points: Sequence[Point], seeds: range) -> Array:
        """Features of simulated records: all cycles of one have one step of the comparators."""
        steps = self.plant.noise_steps
        runs = self.plant.repeated(points, self.cycles, len(seeds), seeds.start, steps)
        return np.array([np.concatenate([at[c].features for c in self.cycles], axis=1) for at in runs])

    def differences(self, point: Point, points: Sequence[Point], seeds: range) -> Array:
        """Changes of the mean features, simulated with one cycle of each motion."""
        first = self.plant.first
        here, *there = self.plant.means([point, *points], first, len(seeds), seeds.start)
        of = [first[int(self.plant.data.motion[c])] for c in self.cycles]
        return np.array([np.concatenate([at[c] - here[c] for c in of]) for at in there])


def as_cause(tried: Sequence[Candidate]) -> Cause:
    """One effect with the parameters of all its candidates; where the later ones are probed, fits begin as well."""
    effect = registry()[tried[0].effect]
    declared = {p.name: p for p in effect.parameters}
    parameters: dict[str, Parameter] = {}
    for c in tried:
        for free in c.frees:
            p = declared[free.name.split(".")[1]]
            neutral = c.fixed.get(p.name, p.neutral)
            usual = abs(p.start - neutral) or 0.1 * (free.high - free.low)
            parameters.setdefault(free.name, Parameter(free.name, free.low, free.high, usual, free.step, neutral))
    starts = tuple(dict(probe) for c in tried[1:] for probe in c.probes())
    return Cause(effect.name, tuple(parameters.values()), PRIOR, starts, effect.mistaken_for)
