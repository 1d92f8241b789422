"""A plant whose effects are columns: linear, and known to the last digit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ema.discrepancy.plant import Block, Candidate, Errors, Free

N_BLOCKS, N = 12, 120
QUIET = 1.0  # noise of a whitened residual


class Toy:
    """Residuals are noise and columns: one of the base parameter `k`, and one for each effect.

    `hidden` are sizes of effects that act; `others` columns that act and that no candidate has.
    """

    noise_uncertainty = 0.0
    noise_uncertainties = (0.0, 0.0, 0.0)
    noisier = None

    def __init__(
        self, seed: int, effects: Sequence[str] = ("a", "b"), others: float = 0.0, k: float = 0.0, **hidden: float
    ):
        rng = np.random.default_rng(seed)
        self.blocks = [Block("record", stretch=j) for j in range(N_BLOCKS)]
        self.columns = {name: rng.standard_normal((N_BLOCKS, 1, N)) for name in ("k", *effects)}
        y = QUIET * rng.standard_normal((N_BLOCKS, 1, N)) + others * rng.standard_normal((1, 1, N)).cumsum(axis=2)
        self.y = y + sum(size * self.columns[name] for name, size in {"k": k, **hidden}.items())
        self.base = [Free("k", "1", -1.0, 1.0, 0.0, 0.1)]
        self.effects = effects

    def residuals(self, points, blocks):
        return [
            [self.y[j] - sum(v * self.columns[n.removesuffix(".size")][j] for n, v in p.items()) for j in blocks]
            for p in points
        ]

    def candidates(self, point, blocks):
        return [
            Candidate(n, n, (Free(f"{n}.size", "N m", -5.0, 5.0, 0.1, 0.1),), ({f"{n}.size": 0.1},))
            for n in self.effects
            if f"{n}.size" not in point
        ]

    def structure(self, point, blocks):
        return []

    def errors(self, point, blocks, fitted=None):
        r = np.concatenate([x.ravel() for x in self.residuals([point], blocks)[0]])
        return Errors(float(np.sqrt(np.mean(r**2))), QUIET, float(len(r)))

    def is_of_sensor(self, candidate):
        return False

    def free_run_errors(self, point, blocks):
        return [x.ravel() for x in self.residuals([point], blocks)[0]]

    def describe(self, candidates, point, draw):
        drawn = draw(50)
        return [
            {
                "key": c.key,
                "name": c.effect,
                "parameters": {f.name: [p[f.name] for p in drawn if f.name in p] for f in c.free},
            }
            for c in candidates
        ]

    def describe_structure(self, terms, point):
        return {}
