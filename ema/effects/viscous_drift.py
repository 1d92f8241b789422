"""Viscous friction that drifts within a cycle: oil and grease that warm up, where no temperature is recorded."""

from __future__ import annotations

from .base import Effect, Parameter


def torque(w_m, t, dT, rate, since):
    """τ = r (t - t_0) ω   [N m]"""
    return rate * (t - since) * w_m


EFFECT = Effect(
    name="viscous_drift",
    parameters=(
        Parameter("rate", "N m/rad", 0.0, -1.0, 1.0, -1e-5, "growth of the viscous coefficient [N m s/rad] per second"),
        Parameter("since", "s", 0.0, -1e6, 1e6, 0.0, "time of a cycle at which the coefficient is the plant file's"),
    ),
    sentence="viscous friction drifts within a cycle by {rate:+.3g} N m s/rad per second",
    separated_by="the same motion cold and warm, with a temperature recorded",
    laws={"drifting_torque": torque},
    mistaken_for=("k1",),
    plants=("axis",),
)
