"""The whole record as its position loop runs it: nothing but the reference is given, from the first sample to the last.

The loop acts on the simulated motion, so errors do not grow as in an open free run; what is left is what the loop
itself would do differently with another plant.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ema.core.records import Array, Cycle
from ema.discrepancy.axis.reading.channels import LOOP_CHANNELS, Roles, known_load
from ema.discrepancy.axis.reading.intake import of_loop
from ema.discrepancy.plant import Point
from ema.models import axis
from ema.models.axis_config import PositionLoop

if TYPE_CHECKING:
    from ema.discrepancy.axis.reading.measured import Measured

FINE = 10  # steps of the simulation in a sample
MOST = 20_000  # samples of a cycle


@dataclass(frozen=True)
class LoopRun:
    """Errors of the closed-loop run: rms over the rms of the channel about its mean."""

    position: float
    drive: float


def closed_loop(plant: Measured, point: Point) -> LoopRun | None:
    """Errors over all cycles; None where no position loop is declared, or no reference recorded."""
    p, loop = plant.plant, plant.plant.position_loop
    position, reference = LOOP_CHANNELS[p.is_linear]
    if loop is None:
        return None
    model = plant.model(point)
    squares = np.zeros((2, 2))
    for b, record in zip(plant.benches, plant.records, strict=True):
        if b.roles.kind not in ("current", "voltage", "force") or not {position, reference} <= set(record.channels):
            return None
        for cycle in record:
            theta, given = _run(plant, model, loop, b.roles, cycle, reference, position)
            n = len(theta)
            for k, (y, x) in enumerate(((cycle[position][:n], theta), (cycle[b.roles.drive][:n], given))):
                squares[k] += float(np.sum((y - x) ** 2)), float(np.sum((y - y.mean()) ** 2))
    errors = np.sqrt(squares[:, 0] / np.maximum(squares[:, 1], 1e-300))
    return LoopRun(float(errors[0]), float(errors[1]))


def _run(
    plant: Measured, model: axis.Model, loop: PositionLoop, who: Roles, cycle: Cycle, reference: str, position: str
) -> tuple[Array, Array]:
    """Position and drive of one cycle, from its measured start."""
    t, ref = cycle["t"][:MOST], cycle[reference][:MOST]
    w_ref = cycle["w_ref"][:MOST] if "w_ref" in cycle else np.gradient(ref, t)
    load = known_load(cycle, who.load)
    supply = cycle["u_dc"] if "u_dc" in cycle else np.full(len(t), plant.plant.V_dc or 1.0)
    theta, given = np.empty(len(t)), np.empty(len(t))
    state, bristle = np.zeros((1, 4)), 0.0
    state[0, 0] = cycle[position][0]
    offsets, step = np.array([0, 2], np.int64), float(np.median(np.diff(t))) / FINE
    for k in range(len(t)):
        theta[k] = state[0, 0]
        y = of_loop(loop, np.array(ref[k] - state[0, 0]), np.array(w_ref[k]), np.array(state[0, 1]))
        given[k] = float(y) * (supply[k] if loop.gives == "duty" else 1.0)
        if k < len(t) - 1:
            drive = np.array([given[k], given[k]])
            window = (offsets, t[k : k + 2], drive, state, step)
            bristles, here = np.array([bristle]), load[k : k + 2]
            out = axis.simulate(model, who.kind, *window, between="held", bristles=bristles, load=here)
            bristle = axis.built_up(model, bristle, out[0, 1] - state[0, 0])
            state[0, :2] = out[0, 1], out[1, 1]
    return theta, given
