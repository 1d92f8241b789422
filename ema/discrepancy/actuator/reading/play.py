"""Whether friction at the user holds it within the play, or its load presses it to one side: read from the record.

With θ_m/GR as recorded, the gap θ_m/GR - θ_u is that of a play operator if the user stays where it was pushed. If a
load moves it, the gap is ±b by the sign of the load, whichever way the rotor turns: all along for a constant load, for
a spring on either side of where it is at rest, from where friction at the user holds it no longer.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ema import faults
from ema.core.records import Array
from ema.discrepancy.findings import Findings
from ema.models import jit  # noqa: F401  where compiled functions are kept
from ema.models.actuator import Actuator

from .features import GROUPS, load_torque, local_mean, motor_torque, spacing
from .held import PLAYS, pressed_user
from .measured import Measured

LOADS = {"constant_load", "spring_load", "position_torque"}
CLEAR = 0.3  # share of the gap's squared rest below which the user is taken as moved by its load
QUANTILES = np.linspace(0.02, 0.98, 25)  # of the positions, at which a load may change its sign
HOLDS = np.array([0.0, 0.04, 0.08, 0.12, 0.16, 0.2, 0.25, 0.3, 0.4, 0.5])  # of the travel, to either side of there
SPEED = 2.0  # [rad/s] over which friction changes its sign


class Pressed(NamedTuple):
    """Where a load presses the user to one side of the play: outside `centre` ± `holds`. [rad]"""

    b: float
    side: float
    centre: float
    holds: float


def take_hold_of_user(plant: Actuator, data: Measured) -> tuple[Actuator, Measured]:
    """Plant and cycles, with a user that its load moves within the play where the record shows that.

    The middle of the play is not seen then, so zeros of sensors that lie apart are not told from it.
    """
    found = find_pressing_load(plant, data) if plant.transmission.F_u is None else None
    if found is None:
        return plant, data
    F_u = float(f"{abs(_stiffness(plant, data)) * found.holds:.3g}") if found.holds else 0.0
    transmission = plant.transmission.model_copy(update={"F_u": F_u})
    return plant.model_copy(update={"transmission": transmission}), replace(data, zero=0.0)


def add_user_friction(stated: Actuator, taken: Actuator, findings: Findings) -> Findings:
    """The findings, with the friction at the user that the load they name overcomes, for extended.yaml."""
    F_u = taken.transmission.F_u
    if F_u == stated.transmission.F_u or not LOADS & {e.name for e in findings.effects}:
        return findings
    findings.notes.append(
        "the load presses the user to one side of the play: friction at the user is "
        + (f"about {F_u:.2g} N m" if F_u else "less than the load")
    )
    return replace(findings, fitted={**findings.fitted, "transmission": taken.transmission.model_dump()})


def find_pressing_load(plant: Actuator, data: Measured) -> Pressed | None:
    """How a load presses the user to one side; None where the play operator leaves no more of the recorded gap."""
    g = plant.transmission
    m = spacing(GROUPS["gap"][0], plant.control.rate, len(data.signals[0].theta_u[0]))
    shafts = [np.ascontiguousarray(s.theta_m[0] / g.GR) for s in data.signals]
    starts = (data.start[:, 0] + (data.zero or 0.0)).tolist()
    gaps = [_level(local_mean(shaft - s.theta_u[0], m)) for shaft, s in zip(shafts, data.signals, strict=True)]

    def left(by: Pressed) -> float:
        users = [pressed_user(shaft, start, *by) for shaft, start in zip(shafts, starts, strict=True)]
        predicted = [_level(local_mean(shaft - user, m)) for shaft, user in zip(shafts, users, strict=True)]
        return sum(float(((gap - x) ** 2).sum()) for gap, x in zip(gaps, predicted, strict=True))

    plays = faults.backlash(g.b, PLAYS).tolist()
    centres = np.quantile(np.concatenate(shafts), QUANTILES).tolist()
    held = min(left(Pressed(b, 1.0, 0.0, np.inf)) for b in plays)
    tried = [Pressed(b, side, centre, 0.0) for b in plays for side in (1.0, -1.0) for centre in (-np.inf, *centres)]
    best = min(tried, key=left)
    if np.isfinite(best.centre):
        travel = float(np.ptp(np.concatenate(shafts)))
        tried = [best._replace(centre=c, holds=float(x)) for c in (best.centre, *centres) for x in HOLDS * travel]
        best = min(tried, key=left)
    return best if left(best) < CLEAR * held else None


def _level(gap: Array) -> Array:
    return np.asarray(gap - gap.mean())


def _stiffness(plant: Actuator, data: Measured) -> float:
    """Torque at the user per position, from the motor's torque balance beside friction, drag and a constant.

    [N m/rad]
    """
    T, GR = 1.0 / plant.control.rate, plant.transmission.GR
    A, y = [], []
    for s in data.signals:
        m = spacing(GROUPS["torque"][0], plant.control.rate, s.theta_m.shape[1])
        w_m = np.gradient(s.theta_m[0], T)
        terms = (s.theta_u[0], np.tanh(w_m / SPEED), w_m, np.ones_like(w_m))
        A.append(np.stack([local_mean(x, m) for x in terms], axis=1))
        y.append(load_torque(plant, motor_torque(plant, s)[0][0], s.theta_m[0], m))
    return GR * float(np.linalg.lstsq(np.concatenate(A), np.concatenate(y), rcond=None)[0][0])
