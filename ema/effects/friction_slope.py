"""Dry friction that changes along the travel: a guide that is preloaded more at one end."""

from __future__ import annotations

from .base import Effect, Parameter


def factor(theta_m, w_m, theta_u, direction, tau_load, slope, centre):
    """F × max(1 + s (θ - θ_c), 0)"""
    return max(1.0 + slope * (theta_m - centre), 0.0)


EFFECT = Effect(
    name="friction_slope",
    parameters=(
        Parameter("slope", "1/rad", 0.0, -1e3, 1e3, 0.01, "growth of friction with the angle, over nominal friction"),
        Parameter("centre", "rad", 0.0, -1e4, 1e4, 0.0, "angle at which friction is the plant file's"),
    ),
    sentence="dry friction changes along the travel by {slope} per rad",
    separated_by="slow motion over the whole travel",
    laws={"static_friction": factor, "sliding_friction": factor},
    mistaken_for=("k1",),
    plants=("axis",),
)
