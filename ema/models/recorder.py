"""What the recorder alone makes of the channels: the controller sees them as they are."""

from __future__ import annotations

import numpy as np

from ema.core.names import CURRENTS, PHASES

from .layout import row

THETA_U = len(CURRENTS) + 1  # place of the user position among the outputs of the kernel


def write_as_recorded(out: np.ndarray, z: np.ndarray, T: float) -> None:
    """Write gains, offsets and delays of the recorder into the outputs of a batch.

    i_rec = (1 + g) i + o,    θ_rec(t) = θ_u(t - τ);  before the start the first value.

    Parameters
    ----------
    out : array, shape (n, n_outputs, n_times)
        Currents first, as behind the anti-alias stages; overwritten. [A, rad]
    z : array, shape (N_ROWS, n)
        Parameters of every run.
    T : float
        Time from one sample to the next. [s]
    """
    g = np.array([z[row(f"recorder_gain.gain_{j}")] for j in PHASES]).T
    o = np.array([z[row(f"recorder_offset.offset_{j}")] for j in PHASES]).T
    if g.any() or o.any():
        out[:, : len(CURRENTS)] = (1.0 + g)[:, :, None] * out[:, : len(CURRENTS)] + o[:, :, None]
    samples = np.arange(out.shape[2])
    delay = z[row("recorder_delay.time")]
    for run in np.flatnonzero(delay):
        out[run, THETA_U] = np.interp(samples - delay[run] / T, samples, out[run, THETA_U])
