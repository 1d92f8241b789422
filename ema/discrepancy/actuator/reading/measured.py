"""Cycles of a record as the search has them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ema.core.records import Array

if TYPE_CHECKING:
    from .features import Signals


@dataclass(frozen=True)
class Measured:
    """All cycles of the records, as the engine wants them.

    Attributes
    ----------
    labels : tuple of str
    commands : list of arrays
        Commanded user position of each *motion*. [rad]
    motion : array of int, shape (n_cycles,)
        Which motion each cycle is.
    signals : list of Signals
        One run each.
    y : list of arrays, shape (n_features,)
        Features of each cycle.
    envelopes : list of arrays
        [A]
    start : array, shape (n_cycles, 2)
        θ_u and θ_m at the start. [rad]
    speed : array, shape (n_cycles,)
        ω_m at the start: a record may be cut out of a longer motion. [rad/s]
    user_speed : array, shape (n_cycles,)
        ω_u at the start: behind play or a soft gear the user may still swing when the rotor rests. [rad/s]
    holding : array, shape (n_cycles, 3)
        Phase currents at the start, their mean taken off. [A]
    dT : array, shape (n_cycles,)
        Winding temperature less 20 °C; zero where it was not recorded. [K]
    has_temperature : bool
    angle_step : float
        Resolution of the recorded rotor angle, 0 if finer than can be seen. [rad]
    angle_noise : float
        White noise of the recorded rotor angle, 0 if less than its motion hides. [rad rms]
    zero : float, optional
        θ_m/GR less θ_u in the middle of the play, None where the record leaves it open. [rad]
    every : int
        Samples from one recorded position to the next, where the record holds straight lines between them; else 1.
    faults : array, shape (n_cycles, 6)
        What each cycle's faults differ by from those of the record.
    ranges : array, shape (n_cycles,)
        Largest current that a cycle's recorder keeps, infinite unless cycles differ in it. [A]
    """

    labels: tuple[str, ...]
    commands: list[Array]
    motion: NDArray[np.int64]
    signals: list[Signals]
    y: list[Array]
    envelopes: list[Array]
    start: Array
    speed: Array
    user_speed: Array
    holding: Array
    dT: Array
    has_temperature: bool
    angle_step: float
    angle_noise: float
    zero: float | None
    every: int
    faults: Array
    ranges: Array

    @property
    def n_cycles(self) -> int:
        """Number of cycles."""
        return len(self.labels)
