"""Clock skew: the recorder's samples are not as far apart as it says."""

from __future__ import annotations

from .base import Effect, Parameter

EFFECT = Effect(
    name="clock_skew",
    parameters=(Parameter("rate", "1", 0.0, -0.02, 0.02, 0.001, "relative error of the sampling interval"),),
    sentence="the recorder's clock is off by {rate:+.2g}",
    separated_by="a record with an external time mark",
    mistaken_for=("k1", "k2"),
    plants=("ema", "axis"),
)
