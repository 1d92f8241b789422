"""Is a whitened residual noise?  Tests with a calibrated false-alarm rate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from ema.core.records import Array

BY_CHANCE = 2.5e-4  # probability of an alarm by all tests together: of 400 records none, nine times in ten
BY_NOISE = 0.005  # that noise, where it was estimated, is as much larger than that: no sample more would help
GROUPS = (1, 8, 64)  # samples averaged before a chi-square: the time scales looked at
N_LAGS = 8
MIN_PAIRS = 30  # of residuals, for their correlation to be one of many products
BOUND = 1.0  # relative uncertainty of an amplitude that is known to its order of magnitude
MOSTLY = 0.5 * BOUND  # from which a bound is most of what is known of it
CLIP = 5.0  # a single wild sample is not a cause


@dataclass(frozen=True)
class Verdict:
    """Answer of the tests: the p-value, after correction for their number, of the one that is nearest to an alarm.

    `level` is the p-value at which that one raises it, `because` what it says.
    """

    p_value: float
    because: str
    rms: float
    level: float

    @property
    def is_noise(self) -> bool:
        """True where the residual is compatible with noise."""
        return self.p_value >= self.level


def average(block: Array, group: int) -> Array:
    """Means over so many samples each, of unit variance where those of the block are, (n_channels, n_groups)."""
    n = block.shape[1] // group * group
    return np.asarray(block[:, :n].reshape(len(block), -1, group).sum(axis=2) / np.sqrt(group))


def scale_test(residuals: Sequence[Array], group: int, noise_uncertainty: float, n_free: int) -> float:
    """P-value of the mean square of group means being no larger than noise makes it."""
    total, count = 0.0, 0
    for block in residuals:
        if block.shape[1] >= group:
            means = average(np.clip(block, -CLIP, CLIP), group)
            total += float((means**2).sum())
            count += means.size
    if count <= n_free:
        return 1.0
    spread = np.sqrt(2.0 / count + (2.0 * noise_uncertainty) ** 2)
    if noise_uncertainty > 0.0:
        return float(stats.norm.sf((total / count - 1.0) / spread))
    return float(stats.chi2.sf(total, count))


def correlation_test(residuals: Sequence[Array]) -> float:
    """P-value of neighbouring residuals being uncorrelated (Ljung and Box over blocks and channels).

    Of each lag by the pairs that there are: blocks may be short.
    """
    n_channels = max((len(block) for block in residuals), default=0)
    statistic, used = 0.0, 0
    for channel in range(n_channels):
        parts = [np.clip(block[channel], -CLIP, CLIP) for block in residuals if channel < len(block)]
        variance = sum(float(x @ x) for x in parts) / max(sum(len(x) for x in parts), 1)
        for lag in range(1, N_LAGS + 1):
            n = sum(max(len(x) - lag, 0) for x in parts)
            if n < MIN_PAIRS or variance == 0.0:
                continue
            statistic += sum(float(x[lag:] @ x[:-lag]) for x in parts) ** 2 / (n * variance**2)
            used += 1
    return float(stats.chi2.sf(statistic, used)) if used else 1.0


def judge(residuals: Sequence[Array], *, noise_uncertainty: float | Sequence[float] = 0.0, n_free: int = 0) -> Verdict:
    """Verdict on residuals.

    Noise of which mostly a bound is known (`MOSTLY`) may have any shape: then only its size is tested.

    Parameters
    ----------
    noise_uncertainty : float or sequence of floats, shape (n_groups,)
        Relative, of the noise's amplitude, alike or for averages over `GROUPS` of samples.
    """
    of = dict(zip(GROUPS, np.broadcast_to(noise_uncertainty, len(GROUPS)).tolist(), strict=True))
    tests = {
        f"residual larger than noise at {g} samples": (
            scale_test(residuals, g, unsure, n_free),
            BY_NOISE if unsure > 0.0 else BY_CHANCE,
        )
        for g, unsure in of.items()
        if g == GROUPS[0] or unsure < MOSTLY
    }
    if of[GROUPS[0]] < MOSTLY:
        tests["neighbouring residuals are correlated"] = (correlation_test(residuals), BY_CHANCE)
    corrected = {name: min(1.0, p * len(tests)) for name, (p, _) in tests.items()}
    level = {name: at for name, (_, at) in tests.items()}
    because = min(tests, key=lambda name: corrected[name] / level[name])
    flat = np.concatenate([np.clip(block, -CLIP, CLIP).ravel() for block in residuals])
    return Verdict(corrected[because], because, float(np.sqrt(np.mean(flat**2))), level[because])
