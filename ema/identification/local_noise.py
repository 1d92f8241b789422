"""How much a noisy model's runs scatter at each instant here, near one point.

The builder's Σ_switch is that of all faults together. With faults, stick, reversal and the ends of the play come at
other instants, and there the runs scatter more; elsewhere less. Measured on three plants at faults of U(0, 0.3): the
variance at an instant is 0.1 to 15 times the builder's, and once instants are scaled to it, covariances differ from the
builder's by no more than chance. So

    Σ = D^½ Σ_switch D^½,   D = diag(d),   ν/d_o ~ χ²_ν

and the runs near that point tell d and ν. With q_o the sum over n runs of the square of the noise at instant o, in
units of the builder's variance, what is expected of the next run is [1]_

    d_o = (ν + q_o)/(ν + n - 2)

averaged over what ν may be. The noise is what a `Correction` of the runs leaves of them, and its weights depend on Σ: a
fixed point, as in expectation maximisation.

References
----------
.. [1] Gelman et al., "Bayesian Data Analysis", 3rd ed., CRC Press, 2013, sections 3.2 and 5.4.
"""

from __future__ import annotations

import numpy as np
from scipy.special import gammaln, softmax

from .correction import Correction

FREEDOMS = 4.0 ** np.arange(1.0, 6.0)  # ν that are compared, 4 … 1024: from unlike the builder's to as good as equal


def local_switching(k: np.ndarray, y: np.ndarray, near: np.ndarray, switching: np.ndarray, M: np.ndarray) -> np.ndarray:
    """Covariance of one run near the points `k`, one step of the fixed point on from `near`.

    Parameters
    ----------
    k, y, M : arrays, shapes (n, d), (n, n_omega), (n_omega, n_omega)
        See `Correction`. [1], [A], [A²]
    near, switching : arrays, shape (n_omega, n_omega)
        Covariance of one run as supposed here so far, and as the builder measured it. [A²]

    Returns
    -------
    array, shape (n_omega, n_omega) [A²]
    """
    squares = Correction(k, y, near, M).squared_noise()
    scale = np.sqrt(scales(squares.sum(axis=0) / np.diag(switching), len(k)))
    return np.asarray(switching * np.outer(scale, scale))


def scales(q: np.ndarray, n: int) -> np.ndarray:
    """d of instants at which the squares of `n` runs sum to `q` (n_omega,), averaged over ν."""
    nu = FREEDOMS[:, None]
    log_p = gammaln(0.5 * (nu + n)) - gammaln(0.5 * nu) + 0.5 * nu * np.log(nu) - 0.5 * (nu + n) * np.log(nu + q)
    return np.asarray(softmax(log_p.sum(axis=1)) @ ((nu + q) / (nu + n - 2.0)))
