"""Gear error: teeth and waves that are not quite alike make a torque at the orders of the gear's wheels.

At constant speed a transmission error e(θ) = a sin(n θ) is felt by the motor as the torque that the load's inertia and
friction take to follow it: a line at the same order, whatever the drive does. A wave generator has two lobes, a mesh as
many periods as teeth meet per motor turn (`ema.models.gear_orders`).

References
----------
Tuttle and Seering, "A nonlinear model of a harmonic drive gear transmission", IEEE Transactions on Robotics and
Automation 12, 1996, doi:10.1109/70.499819.
"""

from __future__ import annotations

from math import pi

from .base import Effect, Parameter

EFFECT = Effect(
    name="gear_error",
    parameters=(
        Parameter("amplitude", "N m", 0.0, 0.0, 10.0, 0.005, "amplitude of the torque line, at the measured side"),
        Parameter("order", "1/turn", 2.0, 1e-4, 1e4, 2.0, "periods per turn of the measured side"),
        Parameter("phase", "rad", 0.0, -pi, pi, 0.0, "phase at an angle of zero"),
    ),
    sentence="gear error: a torque of {amplitude:.3g} N m with {order:.5g} periods per turn, an order of the gear",
    separated_by="the motor alone, uncoupled from the gear; or the position at both sides of the gear",
    mistaken_for=("k1",),
    plants=("axis",),
)
