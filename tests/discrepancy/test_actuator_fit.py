"""Gauss–Newton on a toy plant in milliseconds: when a fit goes on, and when it is given up."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ema.discrepancy.actuator.fitting.fit import fit
from ema.discrepancy.actuator.fitting.free import Free
from ema.discrepancy.actuator.simulating.noise import MotionNoise, Noise
from ema.discrepancy.engine.statistic import Root

N = 400  # features of a cycle
BENT = 0.7


class Toy:
    """Two cycles of one motion whose mean is a bent function of `toy.x` beside two faults; counts what is simulated."""

    def __init__(self, seed: int):
        rng = np.random.default_rng(seed)
        self.A = rng.standard_normal((3, N)) * np.array([[8.0], [8.0], [5.0]])
        self.across = 3.0 * rng.standard_normal(N)  # what no parameter does
        self.first, self.step, self.noise_steps, self.n_motions, self.simulated = [0], None, (1e-6, 2e-6), 1, 0
        y = self.at({"k1": 0.4, "k2": 0.3, "toy.x": 0.5})
        self.data = SimpleNamespace(
            motion=np.zeros(2, int), dT=np.zeros(2), y=[y + rng.standard_normal(N) for _ in "12"]
        )

    def at(self, point):
        k1, k2, x = (point.get(name, 0.0) for name in ("k1", "k2", "toy.x"))
        return np.array([k1, k2, x + BENT * x**2]) @ self.A

    def means(self, points, cycles, n_seeds, seed, steps=None):
        self.simulated += len(points) * len(cycles)
        return [{c: self.at(point) for c in cycles} for point in points]

    def n_seeds(self, cycles, at_least):
        return at_least


def noise_of(plant: Toy) -> Noise:
    noise = object.__new__(Noise)
    fresh = np.random.default_rng(9).standard_normal((60, N))
    noise.plant, noise.point = plant, {}
    noise.motions = [MotionNoise(np.ones(N), WHITE, np.ones(1), fresh, np.arange(60) % 2)]
    return noise


WHITE = Root(np.zeros((N, 1)), np.ones(1), 1.0)  # already
FREES = tuple(Free(name, -2.0, 2.0, 0.05) for name in ("k1", "k2", "toy.x"))


@pytest.mark.parametrize("seed", range(3))
def test_a_fit_that_may_beat_goes_to_its_minimum(seed):
    plant = Toy(seed)
    found = fit(plant, noise_of(plant), FREES, {}, [0, 1], n_iterations=6, to_beat=1.1)
    assert not found.given_up
    assert found.misfit == pytest.approx(1.0, abs=0.1)
    assert found.point["toy.x"] == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("seed", range(3))
def test_a_fit_that_promises_too_little_is_given_up_and_costs_less(seed):
    """Something that no parameter does stays in the record: no step can leave less than that."""
    costs = {}
    for to_beat in (1.1, np.inf):
        plant = Toy(seed)
        plant.data.y = [y + plant.across for y in plant.data.y]
        found = fit(plant, noise_of(plant), FREES, {}, [0, 1], n_iterations=6, to_beat=to_beat)
        assert found.given_up is (to_beat < np.inf)
        assert found.misfit > 5.0
        costs[to_beat] = plant.simulated
    assert costs[1.1] < 0.5 * costs[np.inf]


@pytest.mark.parametrize("seed", range(3))
def test_a_far_start_is_no_reason_to_give_up(seed):
    """The first step's promise is not held against a fit: it starts where it leaves far more than it has to beat."""
    plant = Toy(seed)
    start = {"toy.x": 1.5, "k1": -1.0}
    found = fit(plant, noise_of(plant), FREES, start, [0, 1], n_iterations=8, to_beat=1.5)
    assert not found.given_up
    assert found.misfit < 1.2
