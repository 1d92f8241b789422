"""Filter of the recorded drive: what was recorded follows what acted, as a telegram's averaged current does.

The drive acts at once; the record holds it through a filter of the first order, so that what acted is i + τ di/dt.
"""

from __future__ import annotations

from collections.abc import Mapping

from .base import NOT_NEGATIVE, Effect, Parameter
from .search import AxisSizes, Span

LEAST = 0.5  # samples: by less, what a drive does between samples may be ahead of a straight line


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins, by what the records hold: what is commanded was not measured."""
    if s.driven_by in ("speed-loop", "voltage") or not s.moves:
        return None
    return {"time": Span(LEAST * s.period, 40.0 * s.period, (s.period, 5.0 * s.period), 0.3 * s.period)}


EFFECT = Effect(
    name="drive_filter",
    parameters=(
        Parameter("time", "s", 0.0, 0.0, 0.05, 0.001, "time constant with which the recorded drive follows what acts"),
    ),
    sentence="the recorded drive follows what acts with a time constant of {time:.2g} s (a filter of the recorder)",
    separated_by="a step of the drive with the rotor locked, and a current probe beside the record",
    plants=("axis",),
    limits={"time": NOT_NEGATIVE},
    place="recorder",
    on_axis=on_axis,
)
