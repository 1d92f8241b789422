"""Whether friction at the user holds it within the play, or its load presses it to one side: read from the record.

With θ_m/GR as recorded, the gap θ_m/GR - θ_u is that of a play operator if the user stays where it was pushed. If a
load moves it, the gap is ±b by the sign of the load, whichever way the rotor turns: all along for a constant load, from
one side of a position to the other for a spring.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numba import njit

from ema import faults
from ema.discrepancy.findings import Findings
from ema.effects.backlash import follow
from ema.models.actuator import Actuator

from .cycles import Measured
from .features import GROUPS, Array, local_mean, spacing

FREE = 1.0  # [rad/(s N m)] crosses the play within a millisecond under loads that matter, and is stable in every step
LOADS = {"constant_load", "spring_load", "position_torque"}
CLEAR = 0.3  # share of the gap's squared rest below which the user is taken as moved by its load
PLAYS = np.geomspace(1e-3, 1.0, 20)  # k2 that are tried, beside none
QUANTILES = np.linspace(0.02, 0.98, 25)  # of the positions, at which a load may change its sign


def as_held(plant: Actuator, data: Measured) -> tuple[Actuator, Measured]:
    """Plant and cycles, with a user that its load moves within the play where the record shows that.

    The middle of the play is not seen then, so zeros of sensors that lie apart are not told from it.
    """
    if plant.transmission.mobility or not is_pressed(plant, data):
        return plant, data
    transmission = plant.transmission.model_copy(update={"mobility": FREE})
    return plant.model_copy(update={"transmission": transmission}), replace(data, zero=0.0)


def with_mobility(stated: Actuator, taken: Actuator, findings: Findings) -> Findings:
    """The findings, with the user that the load they name moves within the play, for extended.yaml."""
    if taken.transmission == stated.transmission or not LOADS & {e.name for e in findings.effects}:
        return findings
    section = taken.transmission.model_dump()
    findings.notes.append("the load presses the user to one side of the play, nothing holds it there (mobility)")
    return replace(findings, fitted={**findings.fitted, "transmission": section})


def is_pressed(plant: Actuator, data: Measured) -> bool:
    """Whether a gap by the sign of a load leaves clearly less of the recorded one than the play operator does."""
    g = plant.transmission
    m = spacing(GROUPS["gap"][0], plant.control.rate, len(data.signals[0].theta_u[0]))
    shafts = [np.ascontiguousarray(s.theta_m[0] / g.GR) for s in data.signals]
    gaps = [_level(local_mean(shaft - s.theta_u[0], m)) for shaft, s in zip(shafts, data.signals, strict=True)]

    def left(predicted: list[Array]) -> float:
        return sum(float(((gap - _level(x)) ** 2).sum()) for gap, x in zip(gaps, predicted, strict=True))

    held, pressed = [], []
    everywhere, starts = np.concatenate(shafts), data.start[:, 0] + data.zero
    for b in faults.backlash(g.b, np.concatenate([[0.0], PLAYS])):
        users = [_held(shaft, theta_u, float(b)) for shaft, theta_u in zip(shafts, starts.tolist(), strict=True)]
        held.append(left([local_mean(shaft - user, m) for shaft, user in zip(shafts, users, strict=True)]))
        for centre in (-np.inf, *np.quantile(everywhere, QUANTILES)):
            side = [local_mean(b * np.sign(shaft - centre), m) for shaft in shafts]
            pressed += [left(side), left([-x for x in side])]
    return min(pressed) < CLEAR * min(held)


def _level(gap: Array) -> Array:
    return gap - gap.mean()


@njit(nogil=True)
def _held(shaft: Array, start: float, b: float) -> Array:
    """θ_u behind a play, from where it starts. [rad]"""
    user = np.empty(len(shaft))
    theta_u = start
    for t in range(len(shaft)):
        theta_u = follow(theta_u, shaft[t], b)
        user[t] = theta_u
    return user
