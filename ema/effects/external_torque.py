"""A rotor-locked torque from outside the motor: a neighbour's magnets, or crosstalk of its field.

It has the orders that cogging has, and does not scale with the motor's own current either. Only what is outside tells
it: it goes, changes or turns round where the neighbour goes, turns or stands on the other side; cogging does not.
"""

from __future__ import annotations

from dataclasses import replace

from .base import Effect
from .cogging import EFFECT as COGGING
from .cogging import torque

_amplitude, *_line = COGGING.parameters

EFFECT = Effect(
    name="external_torque",
    parameters=(replace(_amplitude, meaning="amplitude of the torque line from outside the motor"), *_line),
    sentence="rotor-locked torque from outside the motor (a neighbour's magnets, crosstalk): {amplitude:.3g} N m "
    "with {order:.4g} periods per turn",
    separated_by="the same map with the neighbour taken away, or on the other side",
    laws={"shaft_torque": torque},
    mistaken_for=("k1",),
    plants=("axis",),
)
