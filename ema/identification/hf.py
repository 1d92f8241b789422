"""Iterative identification with the HF model itself, warm-started from LF2. Needs a JIT: never in the daemon's process.

Base points and columns of a step are the 16 lanes of one batch. Switching decorrelates two runs at any distance, so a
difference of two runs is mostly noise; instead all runs of a cycle together correct LF2 near the iterate
(`correction`), and Gauss–Newton runs on what is thus the HF model without its noise. What the runs leave open is
part of the covariance.
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
from .measurement import Measurement
from .noise import NoiseModel
from .nuisance import N_FAULTS

if TYPE_CHECKING:
    from ema.bundle import Bundle

SEED = 0x48460000  # of the model's noise; any but the measured actuator's own


class Options(NamedTuple):
    """How many batches of HF runs at most and at least, columns at ±`dk`, and when a step is small [its sd]."""

    n_most: int = 5
    n_least: int = 3
    dk: float = 0.04
    n_base: int = 4
    tolerance: float = 0.3
    length: float = 0.5  # correlation length of LF2's error over ‖k‖, …
    length_least: float = 0.1  # … not less than this


@dataclass(frozen=True)
class _Left(NoiseModel):
    """Noise when the model's error is known but for what a correction leaves."""

    correction: Correction

    def of_model(self, k: np.ndarray) -> np.ndarray:
        """What the runs leave open of the error, shape (n_omega, n_omega). [A²]"""
        return self.correction.covariance(k)


class HfInLoop:
    """Gauss–Newton on HF, whose runs correct the smooth model of `first`."""

    method = "hf"

    def __init__(self, model: Model, first: GaussNewton, options: Options = Options()):  # noqa: B008 - immutable
        self.model, self.first, self.options = model, first, options
        self.switching = first.noise.switching  # of one HF run, whatever becomes of the measurement's

    def estimate(self, measurement: Measurement) -> Estimate:
        """Iterate from LF2's answer; each step adds a batch of runs about the last answer."""
        o, e = self.options, self.first.estimate(measurement)
        if np.isnan(e.k).any():
            return replace(e, method=self.method)
        x_runs, y_runs = np.zeros((0, len(self.first.nuisance.bounds[0]))), np.zeros((0, len(measurement.i_hat)))
        for step in range(o.n_most):
            before, at = e, self.first.nuisance.point(e)
            x = self._columns(at)
            y = self.model(x, measurement.start) - self.first.model(x, measurement.start)
            x_runs, y_runs = np.vstack([x_runs, x]), np.vstack([y_runs, y])
            e = self._corrected(x_runs, y_runs, at, measurement).estimate(measurement)
            if step + 1 >= o.n_least and np.max(np.abs(e.k - before.k) / np.sqrt(np.diag(e.covariance))) < o.tolerance:
                break
        return e

    def _columns(self, x: np.ndarray) -> np.ndarray:
        """Points of a batch: x itself and x ± dk in each element, pushed inside the bounds."""
        sides = self.options.dk * np.vstack([np.eye(len(x)), -np.eye(len(x))])
        return np.vstack([np.tile(x, (self.options.n_base, 1)), np.clip(x + sides, *self.first.nuisance.bounds)])

    def _corrected(self, x: np.ndarray, y: np.ndarray, at: np.ndarray, measurement: Measurement) -> GaussNewton:
        noise, smooth = self.first.noise, self.first.model
        M = noise.covariance(measurement.start, at) - noise.switching
        length = max(self.options.length * float(np.linalg.norm(at)), self.options.length_least)
        correction = Correction(x, y, self.switching, M, length)
        own = {field.name: getattr(noise, field.name) for field in fields(NoiseModel)}
        if measurement.start is not None:
            own["start"] = own["start_k"] = np.zeros_like(noise.start)  # HF knows what the start state does
        return GaussNewton(
            *(self.method, lambda x, start: smooth(x, start) + correction(x), _Left(**own, correction=correction)),
            lambda m: at,
            nuisance=self.first.nuisance,
        )


def make(bundle: Bundle, options: Options = Options()) -> HfInLoop:  # noqa: B008 - immutable
    """The HF identifier of a bundle."""
    plant, schedule, nuisance = bundle.plant, bundle.schedule, bundle.nuisance

    def model(x: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        theta_u, theta_g = np.hsplit(np.zeros(2) if start is None else start, 2)
        state = hf.start_at(plant, theta_u, theta_g * plant.transmission.GR)
        seeds = SEED + np.arange(len(x)) + int(1e6 * np.abs(x).sum())
        runs = hf.simulate(plant, x[:, :N_FAULTS], seeds=seeds, start=state, effects=nuisance.effects(x, plant.effects))
        return runs.envelope[:, schedule]

    return HfInLoop(model, lf2.make(bundle), options)
