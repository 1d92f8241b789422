"""What the drive does to the speed, to first order: what its noise makes of a free run is seen through it."""

from __future__ import annotations

from ema.models.axis_config import Axis

LEAST_R = 1e-9  # [Ohm] where a plant file has none


def pushed(p: Axis, kind: str) -> tuple[float, float]:
    """Acceleration per unit of the drive, and the rate d at which a deviation of the speed dies out.

        dω/dt = -d ω + gain · drive

    Returns
    -------
    gain : float
        [rad/s² or m/s² per unit of the drive]
    damping : float
        d. [1/s]
    """
    J, C = p.inertia, p.C
    k_t, k_e, R = float(p.k_t or 1.0), float(p.k_e or 0.0), max(float(p.R or 0.0), LEAST_R)
    if kind == "current":
        return k_t / J, C / J
    if kind == "voltage":
        return k_t / R / J, (C + k_t * k_e / R) / J
    if kind == "speed-loop":
        K = k_t * (p.loop.K_w if p.loop else 0.0) / J
        return K, K
    return 1.0 / J, C / J
