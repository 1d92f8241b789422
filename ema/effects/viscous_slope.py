"""Viscous friction that changes along the travel: a guide or a screw that is not lubricated alike everywhere."""

from __future__ import annotations

from .base import Effect, Parameter


def torque(theta_m, w_m, theta_u, i_q, slope, centre):
    """τ = s (θ - θ_c) ω   [N m]"""
    return slope * (theta_m - centre) * w_m


EFFECT = Effect(
    name="viscous_slope",
    parameters=(
        Parameter("slope", "N m s/rad^2", 0.0, -1.0, 1.0, 1e-5, "growth of the viscous coefficient with the angle"),
        Parameter("centre", "rad", 0.0, -1e4, 1e4, 0.0, "angle at which the coefficient is the plant file's"),
    ),
    sentence="viscous friction changes along the travel by {slope:+.3g} N m s/rad^2",
    separated_by="fast motion in several places",
    laws={"shaft_torque": torque},
    mistaken_for=("k1",),
    plants=("axis",),
)
