"""Does the record's rotor angle have the plant's zero, sense and phase order?

A resolver's zero and the order of three phases are facts of an installation, not faults; a model with another
convention would explain them by shorts and eccentricity. They show in the phase currents themselves: in six-step
operation the space vector of the currents stands across the rotor,

    i_a + i_b e^{j2π/3} + i_c e^{-j2π/3} ∝ ±e^{j(p θ_m + θ₀ - π/2)},

with + where the torque is positive.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ema.core.errors import RecordError
from ema.core.names import CURRENTS
from ema.core.records import Cycle, Record
from ema.models.actuator import Actuator

FOLLOWS = 0.7  # coherence from which the currents say where the rotor's zero is
SIXTH = np.pi / 3.0  # electrical; by so much the phases' names and signs turn a three-phase motor into itself
MAX_REST = 0.25  # [rad] electrical, beyond what resolvers are out of adjustment and the method errs (0.12 rad)
MIN_SAMPLES = 1000
UNSEEN = 1e-4  # share of a term that the others leave, squared, from which it has a say
SLOW = 2.0  # [rad/s] of the rotor, over which friction changes its sign
POLE_PAIRS = range(1, 25)


class Alignment(NamedTuple):
    """`theta_0`: electrical angle at θ_m = 0 [rad, -π…π]; `reversed_order`: phases B and C are exchanged;
    `coherence`: 0…1, how well the currents follow the rotor angle (below about 0.7 the answer means nothing).
    """

    theta_0: float
    reversed_order: bool
    coherence: float


def aligned(record: Record, plant: Actuator) -> tuple[Record, list[str]]:
    """The record with its phases named and signed as the plant's are, and what was changed, in words.

    Exchanged phases, opposite currents and a rotor zero that is a multiple of 60° electrical away are the same motor in
    other words, and are put right. A record without rotor angle, or whose currents do not tell, is left as it is.

    Raises
    ------
    RecordError
        The rotor zero or the number of pole pairs is another: what would be right.
    """
    cycles = [cycle for cycle in record if cycle.n_samples >= MIN_SAMPLES]
    if not cycles or not {*CURRENTS, "theta_m"} <= set(record.channels):
        return record, []
    n = min(cycle.n_samples for cycle in cycles)
    i = np.array([[cycle[name][:n] for name in CURRENTS] for cycle in cycles])
    theta_m = np.unwrap(np.array([cycle["theta_m"][:n] for cycle in cycles]), axis=-1)
    motor, rate = plant.motor, 1.0 / cycles[0].period
    found = alignment(i, theta_m, motor.p, rate)
    if found.coherence < FOLLOWS:
        by_p = {p: alignment(i, theta_m, p, rate).coherence for p in POLE_PAIRS}
        best = max(by_p, key=lambda p: by_p[p])
        if best != motor.p and by_p[best] > FOLLOWS:
            raise RecordError(
                f"{record.name}: the currents follow the rotor as those of a motor with {best} pole pairs do, "
                f"'{plant.name}' has motor.p = {motor.p}"
            )
        return record, []
    off = float(np.angle(np.exp(1j * (found.theta_0 - motor.theta_0))))
    sixths = round(off / SIXTH)
    rest = off - sixths * SIXTH
    if abs(rest) > MAX_REST:
        order = ", and its phases B and C are exchanged" if found.reversed_order else ""
        raise RecordError(
            f"{record.name}: the rotor's electrical zero is at {found.theta_0:.2f} rad, '{plant.name}' has "
            f"motor.theta_0 = {motor.theta_0:g}{order}; set motor.theta_0: {found.theta_0:.2f} rad in the plant file"
        )
    return _renamed(record, found.reversed_order, sixths % 6)


def _renamed(record: Record, exchanged: bool, sixths: int) -> tuple[Record, list[str]]:
    """Phases exchanged, turned by so many sixths of a turn: a space vector less 60° is a sign, or the next phase."""
    order: tuple[int, ...] = (0, 2, 1) if exchanged else (0, 1, 2)
    opposite, turn = (False, sixths // 2) if sixths % 2 == 0 else (True, ((sixths - 3) % 6) // 2)
    order = tuple(order[(j + turn) % 3] for j in range(3))
    if order == (0, 1, 2) and not opposite:
        return record, []
    sign = -1.0 if opposite else 1.0

    def renamed(cycle: Cycle) -> Cycle:
        own = {name: sign * cycle[CURRENTS[j]] for name, j in zip(CURRENTS, order, strict=True)}
        return replace(cycle, channels={**cycle.channels, **own})

    said = []
    if order != (0, 1, 2):
        names = ", ".join(CURRENTS[j] for j in order)
        said.append(f"its phases in the plant's order are {names} (k3, k4, k5 are these)")
    if opposite:
        said.append("its currents have the opposite sign")
    text = f"{record.name}: {' and '.join(said)}; taken so"
    return replace(record, cycles=tuple(map(renamed, record.cycles))), [text]


def alignment(i_abc: np.ndarray, theta_m: np.ndarray, p: int, rate: float) -> Alignment:
    """Find the rotor's electrical zero from phase currents.

    Parameters
    ----------
    i_abc : array, shape (n, 3, n_times)
        Phase currents of n cycles. [A]
    theta_m : array, shape (n, n_times)
        Rotor angle. [rad]
    p : int
        Pole pairs.
    rate : float
        Sampling rate. [Hz]
    """
    a = np.exp(2j * np.pi / 3)
    found = []
    for swapped in (False, True):
        i_a, i_b, i_c = np.moveaxis(i_abc[:, [0, 2, 1]] if swapped else i_abc, 1, 0)
        x = (i_a + a * i_b + a.conjugate() * i_c) * np.exp(-1j * p * theta_m)  # in the rotor's frame
        squared = np.sum(x * x)  # the torque's sign drops out
        coherence = float(np.abs(squared) / max(np.sum(np.abs(x) ** 2), 1e-30))
        angle = 0.5 * np.angle(squared)
        if _opposes(_smooth(np.real(x * np.exp(-1j * angle)), rate), theta_m, rate):
            angle += np.pi
        found.append(Alignment(float(np.angle(np.exp(1j * (angle + np.pi / 2)))), swapped, coherence))
    return max(found, key=lambda alignment: alignment.coherence)


def _opposes(torque: np.ndarray, theta_m: np.ndarray, rate: float) -> bool:
    """Whether a torque has the wrong sign: it must accelerate the rotor and overcome its friction.

    A spring at the user may take more than both, against the acceleration of a sine; so what goes with the position is
    set aside, and each of the two has a say by as much as it is seen beside it.
    """
    speed = _smooth(np.gradient(theta_m, 1.0 / rate, axis=-1), rate)
    acceleration = np.gradient(speed, 1.0 / rate, axis=-1)
    terms = [x.ravel() for x in (acceleration, np.tanh(speed / SLOW), theta_m, np.ones_like(theta_m))]
    X = np.stack([x / max(float(np.linalg.norm(x)), 1e-300) for x in terms], axis=1)
    inverse = np.linalg.inv(X.T @ X + UNSEEN * np.eye(len(terms)))
    seen = 1.0 / np.sqrt(np.diag(inverse))  # what the other terms leave of each
    return bool((inverse @ X.T @ torque.ravel() * seen)[:2].sum() < 0.0)


def _smooth(x: np.ndarray, rate: float) -> np.ndarray:
    from scipy.ndimage import uniform_filter1d

    return np.asarray(uniform_filter1d(x, max(3, round(3e-3 * rate)), axis=-1))
