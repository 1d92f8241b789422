"""Iterative identification with the HF model itself, warm-started from LF2. Needs a JIT: never in the daemon's process.

The runs of a step are the 16 lanes of one batch: some at the last answer, the others where the truth may be if that
answer is off by what it says. Switching decorrelates two runs at any distance, so a difference of two runs is mostly
noise; instead all runs of a cycle together correct LF2 near the answer (`correction`), and Gauss–Newton runs on what is
thus the HF model without its noise. What the runs leave open, where the truth may be, is part of the covariance.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ema.models import hf

from . import lf2
from .correction import Correction
from .estimate import Estimate
from .gauss_newton import GaussNewton, Model
from .local_noise import local_switching
from .measurement import Measurement
from .noise import NoiseModel
from .nuisance import N_FAULTS

if TYPE_CHECKING:
    from ema.bundle import Bundle

N_SWEEPS = 2  # of the runs' covariance in each step; it begins with the last step's
SEED = 0x48460000  # of the model's noise; any but the measured actuator's own


class Options(NamedTuple):
    """How many batches of HF runs at most and at least, and when a step is small [its sd]."""

    n_most: int = 5
    n_least: int = 3
    n_base: int = 4  # runs of a batch at the answer itself
    reach: float = 0.1  # from the answer, within which all runs are [share of a complete failure]
    tolerance: float = 0.3


@dataclass(frozen=True, kw_only=True)
class _Left(NoiseModel):
    """Noise when the model's error is known but for what a correction leaves, on average where the truth may be."""

    left: np.ndarray

    def of_model(self, k: np.ndarray) -> np.ndarray:
        """What the runs leave open of the error, shape (n_omega, n_omega). [A²]"""
        return self.left


class HfInLoop:
    """Gauss–Newton on HF, whose runs correct the smooth model of `first`."""

    method = "hf"

    def __init__(self, model: Model, first: GaussNewton, options: Options = Options()):  # noqa: B008 - immutable
        self.model, self.first, self.options = model, first, options
        self.noise = replace(first.noise, start_sd=np.zeros(2))  # runs begin where the cycle may have: it is in theirs
        self.switching = first.noise.switching  # of one run, at any faults

    def estimate(self, measurement: Measurement) -> Estimate:
        """Iterate from LF2's answer; each step adds a batch of runs about the last answer."""
        o, e = self.options, self.first.estimate(measurement)
        if np.isnan(e.k).any():
            return replace(e, method=self.method)
        S = self.switching
        x_runs, y_runs = np.zeros((0, len(self.first.nuisance.bounds[0]))), np.zeros((0, len(measurement.i_hat)))
        for step in range(o.n_most):
            before, at = e, self.first.nuisance.point(e)
            rng = np.random.default_rng(SEED + step)
            x = np.vstack([np.tile(at, (o.n_base, 1)), self._around(e, rng)])
            y = self.model(x, measurement.start) - self.first.model(x, measurement.start)
            x_runs, y_runs = np.vstack([x_runs, x]), np.vstack([y_runs, y])
            elsewhere = self._around(e, rng)  # no run was there: the truth is at none of the runs' points either
            M = self._error_before(at, measurement)
            for _ in range(N_SWEEPS):
                S = local_switching(x_runs, y_runs, S, self.switching, M)
            correction = Correction(x_runs, y_runs, S, M)
            e = self._corrected(correction, S, at, elsewhere, measurement).estimate(measurement)
            if step + 1 >= o.n_least and np.max(np.abs(e.k - before.k) / np.sqrt(np.diag(e.covariance))) < o.tolerance:
                break
        return e

    def _around(self, e: Estimate, rng: np.random.Generator) -> np.ndarray:
        """Where the truth may be: points of an answer's distribution, shape (2 d, d), pushed inside the bounds.

        Its mean and covariance are those of the points x ± √d L Q, L Lᵀ = C, for any orthogonal Q; Q is drawn, so that
        batches see different directions (Genz, Monahan, SIAM J. Sci. Comput. 19 (1998) 426).
        """
        nuisance = self.first.nuisance
        x, C = nuisance.point(e), nuisance.spread(e)
        Q = np.linalg.qr(rng.standard_normal(C.shape))[0]
        sides = np.sqrt(len(x)) * (np.linalg.cholesky(C) @ Q).T
        sides *= np.minimum(self.options.reach / np.linalg.norm(sides, axis=1, keepdims=True), 1.0)
        return np.clip(x + np.vstack([sides, -sides]), *nuisance.bounds)

    def _error_before(self, at: np.ndarray, measurement: Measurement) -> np.ndarray:
        """Covariance of the smooth model's error near `at` before any run, shape (n_omega, n_omega). [A²]"""
        return self.noise.covariance(measurement.start, at) - self.noise.switching

    def _corrected(
        self, correction: Correction, switching: np.ndarray, at: np.ndarray, elsewhere: np.ndarray,
        measurement: Measurement,
    ) -> GaussNewton:  # fmt: skip
        """Gauss–Newton on the smooth model and its correction; `switching`: covariance of one run here."""
        noise, smooth = self.noise, self.first.model
        own = {field.name: getattr(noise, field.name) for field in fields(NoiseModel)} | {"switching": switching}
        if measurement.start is not None:
            own["start"] = own["start_k"] = np.zeros_like(noise.start)  # HF knows what the start state does
        return GaussNewton(
            self.method,
            lambda x, start: smooth(x, start) + correction(x),
            _Left(**own, left=correction.covariance(elsewhere)),
            lambda m: at,
            nuisance=self.first.nuisance,
        )


def make(bundle: Bundle, options: Options = Options()) -> HfInLoop:  # noqa: B008 - immutable
    """The HF identifier of a bundle."""
    plant, schedule, nuisance = bundle.plant, bundle.schedule, bundle.nuisance

    def model(x: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        seeds = SEED + np.arange(len(x)) + int(1e6 * np.abs(x).sum())
        theta_u, theta_g = np.zeros((2, len(x)))
        if start is not None:
            theta_u = plant.sensors.positions(float(start[0]), len(x), np.random.default_rng(seeds[0]))
            theta_g += start[1]
        state = hf.start_at(plant, theta_u, theta_g * plant.transmission.GR)
        runs = hf.simulate(plant, x[:, :N_FAULTS], seeds=seeds, start=state, effects=nuisance.effects(x, plant.effects))
        return runs.envelope[:, schedule]

    return HfInLoop(model, lf2.make(bundle), options)
