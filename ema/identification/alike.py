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
SEEN = 0.02  # mean of the two least from which it is told
SPREAD = 0.25  # of the two least, relative to their mean, up to which they are alike in any case
N_SIGMA = 3.0
CHI2 = float(chdtri(1, 0.05))  # of their difference, up to which it is what noise makes of none


def common_shorts(k: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, ...]:
    """The common direction (6,) of three shorts that are seen, the two least alike; empty otherwise.

    The third may have grown beside a weaker magnet.

    Parameters
    ----------
    k : array, shape (6,)
    covariance : array, shape (6, 6)
    """
    least = np.flatnonzero(SHORTS)[np.argsort(k[SHORTS])[:2]]
    C = covariance[np.ix_(least, least)]
    mean, sd = float(k[least].mean()), float(np.sqrt(max(C.sum(), 0.0))) / 2.0
    if mean < max(SEEN, N_SIGMA * sd):
        return ()
    difference, variance = float(np.diff(k[least])[0]), float(C[0, 0] + C[1, 1] - 2.0 * C[0, 1])
    alike = difference < SPREAD * mean or difference**2 < CHI2 * variance
    return (SHORTS / np.linalg.norm(SHORTS),) if alike else ()
