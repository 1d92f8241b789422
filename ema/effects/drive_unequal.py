"""A drive whose torque per current differs by polarity: one half bridge or one side of a sensor that is off."""

from __future__ import annotations

from .base import Effect, Parameter


def torque(theta_m, w_m, theta_u, i_q, positive, negative):
    """τ = c₊ i where i > 0, c₋ i where i < 0: of the torque k_t i, that part is lost   [N m]"""
    return positive * max(i_q, 0.0) + negative * min(i_q, 0.0)


EFFECT = Effect(
    name="drive_unequal",
    parameters=(
        Parameter("positive", "N m/A", 0.0, -1.0, 1.0, 0.001, "torque per current lost while it is positive"),
        Parameter("negative", "N m/A", 0.0, -1.0, 1.0, -0.001, "torque per current lost while it is negative"),
    ),
    sentence="the drive gives another torque with each polarity: {positive:+.3g} N m/A of the current is lost while it "
    "is positive, {negative:+.3g} N m/A of the current while it is negative (below zero is gained)",
    separated_by="the same motions with the drive's polarity reversed",
    laws={"shaft_torque": torque},
    mistaken_for=("k1",),
    plants=("axis",),
)
