"""Clock skew: samples are not as far apart as the record says, by the recorder's clock or by the controller's too.

The currents (of an axis: its drive) may have a converter with a clock of its own: then they alone are sampled at
t (1 + currents) + late.
"""

from __future__ import annotations

from collections.abc import Mapping

from .base import ONE_STEP, SHARE, Effect, Parameter
from .search import AxisSizes, Look, Span


def on_axis(s: AxisSizes) -> Mapping[str, Span]:
    """Where a search begins, by what the records hold."""
    return {"rate": Span(-0.05, 0.05, (0.002,), 0.002)}


CYCLE = 0.5  # [s] over which a clock that is off by so much is a step off

EFFECT = Effect(
    name="clock_skew",
    parameters=(
        Parameter("rate", "1", 0.0, -0.02, 0.02, 0.001, "relative error of the sampling interval, commands in time"),
        Parameter("shared", "1", 0.0, -0.02, 0.02, 0.002, "relative error of the interval of samples and commands"),
        Parameter("currents", "1", 0.0, -0.02, 0.02, 1e-4, "the same of the currents, or an axis' drive, alone"),
        Parameter("late", "s", 0.0, -2e-3, 2e-3, 1e-4, "time by which the currents are sampled after the rest"),
    ),
    sentence="the clocks of the record differ:",
    besides={
        "rate": " the recorder's is off by {rate:+.2g}",
        "shared": " that which recorder and controller share is off by {shared:+.2g}",
        "currents": " that of the currents (or of the drive) is off by {currents:+.2g}",
        "late": " the currents (or the drive) are sampled {late:+.2g} s after the other channels",
    },
    separated_by="a record with an external time mark",
    mistaken_for=("k1", "k2"),
    plants=("ema", "axis"),
    limits={"rate": SHARE, "shared": SHARE, "currents": SHARE},
    least_sd={**dict.fromkeys(("rate", "shared", "currents"), ONE_STEP / CYCLE), "late": ONE_STEP},
    place="recorder",
    looks=(
        Look("rate", steps={"rate": 1e-4}),
        Look("shared", steps={"shared": 5e-4}),
    ),
    on_axis=on_axis,
)
