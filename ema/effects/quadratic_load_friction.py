"""Friction that grows with the square of the torque passed on: teeth that are pressed ever wider into their contact."""

from __future__ import annotations

from .base import NOT_NEGATIVE, Effect, Parameter


def factor(theta_m, w_m, theta_u, direction, tau_load, per_square):
    """F × (1 + c τ²)"""
    return 1.0 + per_square * tau_load * tau_load


EFFECT = Effect(
    name="quadratic_load_friction",
    parameters=(
        Parameter(
            *("per_square", "1/(N m)^2", 0.0, 0.0, 400.0, 5.0),
            "growth of friction per motor torque squared, over nominal friction",
        ),
    ),
    sentence="friction grows with the square of the torque passed on, by {per_square} per (N m)²",
    separated_by="motions with different accelerations or loads at the same speed",
    laws={"static_friction": factor, "sliding_friction": factor},
    mistaken_for=("k1",),
    plants=("axis",),
    limits={"per_square": NOT_NEGATIVE},
)
