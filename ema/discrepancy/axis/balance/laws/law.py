"""What a law of the balance is."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ema.core.records import Array

if TYPE_CHECKING:
    from .motion import Motion


@dataclass(frozen=True)
class Acting:
    """What acts along the motion by the model so far: arrays of shape (n_samples,). [N m or N]

    `motor` is the torque the drive must give, `load` what of it is not friction, `held` what of that is not inertia.
    """

    motor: Array
    load: Array
    held: Array


BY_RECORD = " by record"  # in family and key of what is fitted once for each
BY_RECORD_NAME = "_by_record"  # in its name

Columns: TypeAlias = "Callable[[Motion, Acting], tuple[Array, ...]]"
Values = Callable[[Array], Mapping[str, float]]


@dataclass(frozen=True)
class Law:
    """A law, linear in its coefficients.

    Parameters
    ----------
    family, key : str
        One member of a family acts (but of lines several may); families compete.
    name : str
        Of the effect, as `ema.effects` has it where it has it.
    columns : function (motion, acting) → arrays of shape (n_samples,)
    parameters : mapping of str to str
        Units by name; `values` makes them of the coefficients.
    sentence : str
        With the parameters' names in braces.
    also : tuple of str
        Laws that no balance of one axis can tell from it.
    is_friction : bool
        Whether it takes power whichever way the axis goes; else it is a load.
    needs_acting : bool
        Whether its columns depend on what else acts.
    n_columns : int
    weak : function motion → pairs of arrays (n_samples,)
        Where a column is f + dp/dt: f and p, so that no derivative of p is taken.
    repeats : Law or None
        The law of which it has the columns once for each record.
    finer : function share → laws
        Of a family whose members stand for all between them: those that lie this share of a step to both sides.
    among : Among or None
        The same of a family of few members: asked for once the law is chosen, so that no finer member chooses it.
    freer : function (motion, acting) → arrays of shape (n_samples,)
        Of what has no name, and so no form: columns of the same with twice the freedom.
    """

    family: str
    key: str
    name: str
    columns: Columns
    parameters: Mapping[str, str]
    values: Values
    sentence: str
    separated_by: str
    also: tuple[str, ...] = ()
    is_friction: bool = False
    needs_acting: bool = False
    n_columns: int = 1
    repeats: Law | None = None
    weak: Callable[[Motion], Sequence[tuple[Array, Array]]] | None = None
    finer: Callable[[float], Sequence[Law]] | None = None
    among: Among | None = None
    freer: Columns | None = None


@dataclass(frozen=True)
class Among:
    """Where a law stands in a family that goes on between its members.

    Parameters
    ----------
    at : array, shape (n_sizes,)
        Its sizes, in steps from one member to the next.
    ends : array, shape (n_sizes, 2)
        Of the family, in the same.
    member : function array → Law
        The law of other sizes.
    """

    at: Array
    ends: Array
    member: Callable[[Array], Law]

    def moved(self, by: Array) -> Law:
        """The member so many steps away, or at the family's end."""
        return self.member(np.clip(self.at + by, *self.ends.T))


def one(name: str, **shape: float) -> Values:
    """The only coefficient, and the shape of the law beside it."""

    def values(c: Array) -> Mapping[str, float]:
        return {name: float(c[0]), **shape}

    return values
