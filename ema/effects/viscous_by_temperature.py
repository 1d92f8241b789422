"""Viscous friction that falls as the lubricant warms up, by Reynolds' exponential.

Arrhenius' exp(E/(R_g T)) is this law with k = E/(R_g T²): over the 40 K of a warm-up the two differ by less than other
laws of friction do, and k needs no second temperature.

References
----------
Bittencourt and Gunnarsson, "Static friction in a robot joint: modeling and identification of load and temperature
effects", Journal of Dynamic Systems, Measurement, and Control 134, 2012, doi:10.1115/1.4006589 (measured: exponential).
"""

from __future__ import annotations

from numba import njit

from .base import Effect, Parameter
from .vector_math import exp_negative


@njit(inline="always")
def kept(dT, per_kelvin):
    """exp(-k ΔT), for |k ΔT| below 60: what is left of friction at 20 °C"""
    x = per_kelvin * dT
    falls = exp_negative(-abs(x))
    return falls if x >= 0.0 else 1.0 / falls


def torque(w_m, t, dT, per_kelvin, coefficient):
    """τ = C_20 [exp(-k ΔT) - 1] ω   [N m]"""
    return coefficient * (kept(dT, per_kelvin) - 1.0) * w_m


EFFECT = Effect(
    name="viscous_by_temperature",
    parameters=(
        Parameter("per_kelvin", "1/K", 0.0, -0.1, 0.1, 0.02, "share of viscous friction lost per kelvin above 20 °C"),
        Parameter(
            "coefficient", "N m s/rad", 0.0, 0.0, 1e6, 1e-4, "viscous coefficient at 20 °C that it is a share of"
        ),
    ),
    sentence="viscous friction falls by {per_kelvin:.2%} per kelvin of the recorded temperature",
    separated_by="the same motion cold and warm, and once more after the axis has cooled down",
    laws={"drifting_torque": torque},
    mistaken_for=("k1",),
    plants=("axis",),
)
