"""Clock skew: samples are not as far apart as the record says, by the recorder's clock or by the controller's too."""

from __future__ import annotations

from .base import SHARE, Effect, Parameter

EFFECT = Effect(
    name="clock_skew",
    parameters=(
        Parameter("rate", "1", 0.0, -0.02, 0.02, 0.001, "relative error of the sampling interval, commands in time"),
        Parameter("shared", "1", 0.0, -0.02, 0.02, 0.002, "relative error of the interval of samples and commands"),
    ),
    sentence="the recorder's clock is off by {rate:+.2g}",
    besides={"shared": " and the clock that it shares with the controller by {shared:+.2g}"},
    separated_by="a record with an external time mark",
    mistaken_for=("k1", "k2"),
    plants=("ema", "axis"),
    limits={"rate": SHARE, "shared": SHARE},
)
