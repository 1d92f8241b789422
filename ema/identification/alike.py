"""Faults that rise alike where one other cause reads the same: three equal shorts are what a weaker magnet does.

A magnet weaker by δ and δ of the turns shorted in each phase differ by 4 % of their response; no model is trusted that
far. The likelier of the two is the magnet, which needs no coincidence.
"""

from __future__ import annotations

import numpy as np
from scipy.special import chdtri

from ema.core.names import FAULTS

SHORTS = np.array([name in ("k3", "k4", "k5") for name in FAULTS])
CAUSE = "magnet_flux.change"
SEEN = 0.02  # mean of the three from which it is told
SPREAD = 0.25  # of the three, relative to their mean, up to which they are alike in any case
N_SIGMA = 3.0
DIFFERENCES = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0]])
CHI2 = float(chdtri(len(DIFFERENCES), 0.01))  # of the differences, up to which they are what noise makes of none


def common_shorts(k: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, ...]:
    """The common direction (6,) of three shorts that are seen and alike; empty otherwise.

    Parameters
    ----------
    k : array, shape (6,)
    covariance : array, shape (6, 6)
    """
    e = SHORTS / SHORTS.sum()
    mean, sd = float(e @ k), float(np.sqrt(max(e @ covariance @ e, 0.0)))
    if mean < max(SEEN, N_SIGMA * sd):
        return ()
    difference = DIFFERENCES @ k[SHORTS]
    C = DIFFERENCES @ covariance[np.ix_(SHORTS, SHORTS)] @ DIFFERENCES.T
    as_noise = float(difference @ np.linalg.pinv(C) @ difference) < CHI2
    return (SHORTS / np.linalg.norm(SHORTS),) if as_noise or np.ptp(k[SHORTS]) < SPREAD * mean else ()
