"""How an effect says where a search for it begins: on a three-phase actuator by a look, on an axis by spans."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple


class Look:
    """A first look at an effect on a three-phase actuator: switched on by a known amount, for each linear parameter.

    Parameters
    ----------
    linear : str
        Parameters that the effect is (nearly) proportional to.
    steps : mapping of str to float
        Amount of each; where none is given, from its neutral value to its `start`.
    at : mapping of str to float
        Values of other parameters, from which a fit begins.
    needs : str
        What must be recorded for it to show: the ``supply``, or ``warming`` of the windings.
    """

    def __init__(
        self,
        *linear: str,
        steps: Mapping[str, float] | None = None,
        at: Mapping[str, float] | None = None,
        needs: Literal["", "supply", "warming"] = "",
    ) -> None:
        self.linear, self.steps, self.at, self.needs = linear, dict(steps or {}), dict(at or {}), needs


@dataclass(frozen=True)
class AxisSizes:
    """Typical sizes in an axis' records, and what the records and the plant file hold.

    Attributes
    ----------
    torque, speed, drive, current, voltage : float
        Root mean squares, in the units of the axis.
    centre, half_range : float
        Of the position. [rad or m]
    period : float
        Between samples. [s]
    damping : float
        Viscous friction of the plant file.
    supply : float or None
        Supply voltage of the plant file. [V]
    driven_by : str
        What the recorded drive is: ``current``, ``voltage``, ``force``, ``speed-loop`` …
    outputs : set of str
        Channels that are compared.
    fitted : set of str
        Parameters of the plant file that are free in every model.
    turns, moves, warms, is_force : bool
        Whether the axis is rotary, moves in the records, its windings change temperature, its drive is a force.
    """

    torque: float
    speed: float
    drive: float
    current: float
    voltage: float
    centre: float
    half_range: float
    period: float
    damping: float
    supply: float | None
    driven_by: str
    outputs: frozenset[str]
    fitted: frozenset[str]
    turns: bool
    moves: bool
    warms: bool
    is_force: bool

    @property
    def shows_voltage(self) -> bool:
        """Whether the records hold the motor's voltage."""
        return "u_q" in self.outputs or self.driven_by == "voltage"


class Span(NamedTuple):
    """Where a parameter is searched: bounds, where fits begin, and a change that matters."""

    low: float
    high: float
    starts: Sequence[float]
    scale: float


# The first parameter is the one that switches the effect off. None: the records cannot show it.
OnAxis = Callable[[AxisSizes], Mapping[str, Span] | None]
