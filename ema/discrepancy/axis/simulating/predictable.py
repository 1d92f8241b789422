"""Over which time the motion of a record can be foretold from a noisy start: windows are no longer than that."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import stats

from ema.discrepancy.axis.reading.windows import Bench
from ema.discrepancy.axis.scanning.cogging import ALARM, integer_orders, scan
from ema.discrepancy.axis.scanning.fading import SPEEDS, fadings
from ema.discrepancy.axis.scanning.weak_form import FEWEST, Weak, weak_form
from ema.models import axis

if TYPE_CHECKING:
    from ema.discrepancy.axis.reading.measured import Measured

N_GROWTHS = 3.0  # growth of e^3 in a window
LONGEST_WINDOW = 0.4  # [s]
STEP = 1e-5  # of the travel, over which a torque's slope is taken


def predictable_time(plant: Measured, bench: Bench) -> float:
    """Length of time over which the motion of a record can be foretold from a start state. [s]

    Deviations grow like exp(λ t); after a few of these the start state's noise decides.
    """
    moving = [j for j, w in enumerate(plant.windows) if w.group == bench.name and not w.static]
    if not moving:
        return LONGEST_WINDOW
    weak = weak_form(plant, {}, moving)
    if len(weak.y) < FEWEST:
        return LONGEST_WINDOW
    growth = max(_of_plant_file(plant, weak), _of_lines(plant, weak), _of_falling_friction(plant, weak))
    return float(min(LONGEST_WINDOW, N_GROWTHS / growth)) if growth > 0.0 else LONGEST_WINDOW


def _of_plant_file(plant: Measured, weak: Weak) -> float:
    """λ, λ² = -dτ/dθ / J where the torque that the plant file knows drives away, as a pendulum's upright. [1/s]"""
    m, model = weak.motion, plant.model({})
    step = STEP * float(np.ptp(m.theta))
    if step == 0.0:
        return 0.0
    left, right = (
        axis.torque_along(model, m.theta + d, m.w, m.i, m.t, m.dT, force=plant.plant.is_force) for d in (-step, step)
    )
    slope = float(np.max((right - left) / (2.0 * step)))  # of what accelerates
    return float(np.sqrt(max(slope, 0.0) / plant.plant.inertia))


def _of_lines(plant: Measured, weak: Weak) -> float:
    """λ, λ² = A n / J, beside an angle-locked torque A sin nθ. [1/s]"""
    orders = integer_orders(weak)
    if plant.plant.is_linear or len(orders) == 0:
        return 0.0
    found = scan(weak, orders, max_lines=2)
    stiffness = max((float(np.hypot(*p)) * n for n, p in zip(found.orders, found.parts, strict=True)), default=0.0)
    return float(np.sqrt(stiffness / plant.plant.inertia))


def _of_falling_friction(plant: Measured, weak: Weak) -> float:
    """λ = F / (J ω_s) where friction falls by F over a speed ω_s. [1/s]"""
    speeds = SPEEDS * float(np.sqrt(np.mean(weak.motion.w**2)))
    found = fadings(weak, weak.always(), speeds)
    if not found:
        return 0.0
    columns, rest = weak.beside()
    n_free = len(weak.y) / 4 - columns.shape[1] - 1.0  # neighbouring test functions overlap
    F = (float(rest @ rest) - found[0].left) / found[0].left * n_free
    if stats.f.sf(F, 1, n_free) * len(speeds) > ALARM:
        return 0.0
    return found[0].torque / (plant.plant.inertia * found[0].speed)
