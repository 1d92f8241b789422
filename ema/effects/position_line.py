"""A force that repeats along the travel: a linear motor's magnets, the pitch of a screw, the teeth of a belt.

No whole number of its periods fits into a travel, and it does not close after a turn: on an axis that turns it is
cogging, or an error of the gear.

References
----------
Otten, de Vries, van Amerongen, Rankers and Gaal, "Linear motor motion control using a learning feedforward controller",
IEEE/ASME Transactions on Mechatronics 2, 1997, doi:10.1109/3516.622970.
"""

from __future__ import annotations

from math import pi

from .base import Effect, Parameter

EFFECT = Effect(
    name="position_line",
    parameters=(
        Parameter("amplitude", "N m", 0.0, 0.0, 1e5, 1.0, "amplitude of the line of force"),
        Parameter("order", "rad/m", 2.0 * pi / 0.024, 1e-3, 1e7, 2.0 * pi / 0.024, "2π over its period"),
        Parameter("phase", "rad", 0.0, -pi, pi, 0.0, "phase at a position of zero"),
    ),
    derived={"period": lambda v: 2.0 * pi / v["order"]},
    sentence="a force of {amplitude:.3g} N m once in {period:.4g} m of travel (magnets of a linear motor, pitch of a "
    "screw or a belt)",
    separated_by="slow motion over the whole travel, with the drive off where it can be pulled",
    plants=("axis",),
)
