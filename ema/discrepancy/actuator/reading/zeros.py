"""How far the zeros of the rotor's and the user's sensor lie apart: a condition of the bench, by itself no flaw.

In the middle of the play θ_m/GR = θ_u. Two sensors never agree on their zero that well: a step of the LVDT is half a
degree of the electrical angle. If it is the resolver that is off, and the drive commutates by it, then the commutation
is off too (the effect `commutation_offset`); which of them it is only the torque can tell.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ema.core.records import Array
from ema.models.actuator import Actuator

from .features import Signals, roughness

CLOSED = 0.5  # [rad] of the rotor after it has turned round, from where the play is taken up
STIFF = 1.5  # times the noise of θ_u that θ_m/GR - θ_u may vary by while the play is closed, with a stiff gear
ENOUGH = 100  # samples on either side of the play
SEEN = 2e-6  # [rad at the user] less makes no difference
WOBBLES = (1, 2)  # periods of a resolver's error in a turn of the rotor
MOVING = 2.0  # [rad/s]
DIFFERENCE = 20  # samples over which the speed is taken


def zero_apart(plant: Actuator, signals: Sequence[Signals]) -> float | None:
    """θ_m/GR less θ_u in the middle of the play, 0 if not clear of 0; None where the record leaves it open. [rad]

    A gear that gives and a late sensor leave it open. Beside a resolver that wobbles it is the mean over a turn, and
    open where the rotor turns too little to tell them apart.
    """
    theta_m = np.concatenate([s.theta_m[0] for s in signals])
    d = theta_m / plant.transmission.GR - np.concatenate([s.theta_u[0] for s in signals])
    way = np.concatenate([_way(s.theta_m[0], plant.control.rate) for s in signals])
    sides = np.stack([way > CLOSED, way < -CLOSED]).astype(float)
    if sides.sum(axis=1).min() < ENOUGH:
        return None
    closed = sides.any(axis=0)
    d, theta_m, sides = d[closed], theta_m[closed], sides[:, closed]
    stated = float(np.hypot(plant.sensors.lvdt_noise, plant.sensors.lvdt_step / np.sqrt(12.0)))
    noise = max(stated, *(roughness(s.theta_u) for s in signals))
    wobble = np.stack([of(n * theta_m) for n in WOBBLES for of in (np.cos, np.sin)])
    for terms in (sides, np.concatenate([sides, wobble])):
        middle, known, varies = _middle(terms.T, d)
        if varies < STIFF * noise and known * noise < SEEN:
            return middle if abs(middle) > SEEN else 0.0
    return None


def _middle(terms: Array, d: Array) -> tuple[float, float, float]:
    """The mean of what the first two terms take of `d`, its deviation over that of a sample, and the rms left."""
    taken, *_ = np.linalg.lstsq(terms, d, rcond=None)
    mean = np.zeros(terms.shape[1])
    mean[:2] = 0.5
    known = float(np.sqrt(mean @ np.linalg.pinv(terms.T @ terms) @ mean))
    return float(mean @ taken), known, float(np.std(d - terms @ taken))


def _way(theta_m: Array, rate: float) -> Array:
    """How far the rotor has gone since it last turned round, with the sign of its direction. [rad]"""
    w_m = np.zeros(len(theta_m))
    w_m[DIFFERENCE:] = (theta_m[DIFFERENCE:] - theta_m[:-DIFFERENCE]) * rate / DIFFERENCE
    direction = np.where(np.abs(w_m) > MOVING, np.sign(w_m), 0.0)
    at = np.maximum.accumulate(np.where(direction != 0.0, np.arange(len(w_m)), 0))
    direction = direction[at]  # held while at rest
    turned = np.flatnonzero(np.diff(direction, prepend=direction[0]) != 0.0)
    since = np.zeros(len(w_m), dtype=int)
    since[turned] = turned
    since = np.maximum.accumulate(since)
    return np.asarray(direction * np.abs(theta_m - theta_m[since]))
