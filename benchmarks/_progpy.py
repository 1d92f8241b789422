"""NASA's ProgPy on the same histories: a growth model of two states, its particle filter, its Monte Carlo predictor.

The state is k and the logarithm of its rate, both with process noise: growth that never heals and whose rate drifts, as
ProgPy's documentation does with a wear parameter. The estimates are averaged over equal times first, because its
filters want times that are multiples of dt. The two noises were chosen on histories of another seed.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from ema_postflight.prognosis import LEVELS, MIN_POINTS, Prognosis, Trend

N_STEPS = 50  # of a history
N_PARTICLES, N_PATHS = 3000, 100
FARTHEST = 4.0  # as ours: a median farther away, in histories, is not told
NOISE_K, NOISE_RATE = 0.003, 0.2  # process noise in a step: of k in thresholds, and of the logarithm of the rate

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    from progpy import PrognosticsModel
    from progpy.predictors import MonteCarlo
    from progpy.state_estimators import ParticleFilter
    from progpy.uncertain_data import UnweightedSamples


class Growth(PrognosticsModel):
    """k in thresholds; time in steps."""

    inputs: list[str] = []  # noqa: RUF012
    states = ["k", "ln_rate"]  # noqa: RUF012
    outputs = ["k_hat"]  # noqa: RUF012
    events = ["failure"]  # noqa: RUF012
    is_vectorized = True
    default_parameters = {  # noqa: RUF012
        "x0": {"k": 0.0, "ln_rate": -4.0},
        "process_noise": {"k": NOISE_K, "ln_rate": NOISE_RATE},
        "measurement_noise": 0.0,
    }

    def next_state(self, x: Any, u: Any, dt: float) -> Any:
        return self.StateContainer({"k": x["k"] + np.exp(x["ln_rate"]) * dt, "ln_rate": x["ln_rate"]})

    def output(self, x: Any) -> Any:
        return self.OutputContainer({"k_hat": x["k"]})

    def event_state(self, x: Any) -> dict[str, Any]:
        return {"failure": np.clip(1.0 - x["k"], 0.0, 1.0)}

    def threshold_met(self, x: Any) -> dict[str, Any]:
        return {"failure": x["k"] >= 1.0}


def prognosis(trend: Trend, threshold: float, rng: np.random.Generator) -> Prognosis:
    """As `ema_postflight.prognosis.prognosis`: the same trend, the same kind of answer."""
    step = (trend.t[-1] - trend.t[0]) / N_STEPS
    at, k, sd = _steps(trend, threshold, step)
    if len(at) < MIN_POINTS:
        return _silent("too few")
    np.random.seed(rng.integers(2**32))  # noqa: NPY002  ProgPy draws from numpy's global generator
    model = Growth()
    k_0, ln_rate = rng.normal(k[0], sd[0], N_PARTICLES), rng.uniform(*np.log([1e-4, 0.2]), N_PARTICLES)
    start = UnweightedSamples([{"k": a, "ln_rate": b} for a, b in zip(k_0, ln_rate, strict=True)])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        filter_ = ParticleFilter(model, start, dt=1, t0=0, measurement_noise={"k_hat": float(np.median(sd))})
        for t, value in zip(at[1:], k[1:], strict=True):
            filter_.estimate(float(t), {}, {"k_hat": value})
        now = filter_.x.sample(N_PATHS)
        found = MonteCarlo(model).predict(now, dt=1, horizon=10 * N_STEPS, events=["failure"])
    crossed = [x["failure"] for x in found.time_of_event]
    draws = np.array([np.inf if t is None else max(float(t), 0.5) for t in crossed]) * step
    life = np.quantile(draws, LEVELS, method="inverted_cdf")
    if not np.isfinite(life[2]) or life[1] > FARTHEST * N_STEPS * step:
        return _silent("too far")
    return Prognosis("", life, draws)


def _steps(trend: Trend, threshold: float, step: float) -> Trend:
    """Means over equal times, weighted by 1/sd²; k and sd in thresholds, t in steps."""
    number = np.minimum((trend.t - trend.t[0]) // step, N_STEPS - 1).astype(int)
    weight = np.bincount(number, trend.sd**-2, N_STEPS)
    k = np.bincount(number, trend.k * trend.sd**-2, N_STEPS)
    seen = np.flatnonzero(weight)
    return Trend(seen + 1, k[seen] / weight[seen] / threshold, 1.0 / np.sqrt(weight[seen]) / threshold)


def _silent(reason: str) -> Prognosis:
    return Prognosis(reason, np.full(len(LEVELS), np.nan), np.zeros(0))
