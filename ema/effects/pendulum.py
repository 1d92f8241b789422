"""Gravity on what hangs at a rotary axis: a pendulum, or a load that is not balanced."""

from __future__ import annotations

from math import pi

from .base import Effect, Parameter
from .vector_math import sin


def torque(theta_m, w_m, theta_u, i_q, amplitude, phase, turns):
    """τ = m g r / N sin(θ / N + φ)   [N m], of what hangs behind a gear N:1; `amplitude` m g r / N, `turns` 1 / N"""
    return amplitude * sin(turns * theta_m + phase)


EFFECT = Effect(
    name="pendulum",
    parameters=(
        Parameter("amplitude", "N m", 0.0, 0.0, 100.0, 0.1, "torque at the horizontal, m g r"),
        Parameter("phase", "rad", 0.0, -pi, pi, 0.0, "angle from where it hangs at rest to the zero of the angle"),
        Parameter("turns", "1", 1.0, 1e-5, 1.0, 1.0, "of what hangs, for one of the axis: behind a gear N:1, 1 / N"),
    ),
    sentence="gravity on a pendulum or an unbalanced load of {amplitude:.3g} N m",
    separated_by="the same motion with the shaft upright, or with the load taken off",
    laws={"shaft_torque": torque},
    mistaken_for=("k1",),
    plants=("axis",),
)
