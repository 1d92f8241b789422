"""Pictures of an axis' residual before and after: in time, against angle order, against speed, in frequency."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ema.core.names import CHANNELS
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.scanning.cogging import integer_orders
from ema.discrepancy.axis.scanning.weak_form import weak_form
from ema.discrepancy.outcome import Outcome
from ema.discrepancy.plant import Point
from ema.discrepancy.report import Picture, picture

from .balance_pictures import balance_pictures

N_SHOWN = 12  # windows of a record in the picture over time
N_ORDERS = 160


def pictures(plant: AxisPlant, outcome: Outcome) -> list[Picture]:
    """Pictures record by record, and over all records the torque the model lacks."""
    before: Point = dict(zip(outcome.base, outcome.k_before, strict=True))
    out = [_run(plant, name, before, outcome.point) for name in (b.name for b in plant.benches)]
    out.append(_torque(plant, before, outcome.point))
    if plant.balance is not None:
        out += balance_pictures(plant.balance, linear=plant.plant.is_linear)
    return out


def _run(plant: AxisPlant, name: str, before: Point, after: Point) -> Picture:
    blocks = [j for j, w in enumerate(plant.windows) if w.group == name]
    shown = blocks[len(blocks) // 2 :][:N_SHOWN]
    runs = [plant.simulate(point, shown) for point in (before, after)]
    bench = plant.bench_of(shown[0])
    row = plant.main_row(shown[0])
    channel = bench.roles.drive if bench.static else bench.roles.outputs[row]
    figure = Figure(figsize=(10, 3.6))
    axes = figure.subplots()
    for k, j in enumerate(shown):
        w = plant.windows[j]
        x = w.position if bench.static else w.t
        for y, style, label in (
            (w.outputs[row], "k.", "measured"),
            (runs[0][k][row], "C1-", "nominal model"),
            (runs[1][k][row], "C0-", "extended model"),
        ):
            axes.plot(x, y, style, lw=1, ms=2, label=label if k == 0 else None)
    span = np.concatenate([plant.windows[j].outputs[row] for j in shown])
    room = 0.5 * np.ptp(span) + 1e-12
    axes.set_ylim(span.min() - room, span.max() + room)
    axes.set_xlabel("position" if bench.static else "t [s]")
    axes.set_ylabel(f"{channel} [{CHANNELS[channel].unit}]")
    axes.legend(loc="upper right", fontsize="small")
    return picture(
        f"{name}", "Each window is simulated from its own measured start state with the recorded drive.", figure
    )


def _torque(plant: AxisPlant, before: Point, after: Point) -> Picture:
    """Weak-form torque residual against angle order and against speed."""
    figure = Figure(figsize=(10, 3.6))
    left, right = figure.subplots(1, 2)
    blocks = list(range(len(plant.windows)))
    for point, colour, label in ((before, "C1", "nominal model"), (after, "C0", "extended model")):
        weak = weak_form(plant, point, blocks)
        m = weak.motion
        orders = integer_orders(weak)[:N_ORDERS]
        if len(orders) and len(weak.y):
            size = []
            for n in orders:
                columns = [weak.integrate(f(n * m.theta)) for f in (np.cos, np.sin)]
                c, *_ = np.linalg.lstsq(np.stack([*columns, np.ones(len(weak.y))], axis=1), weak.y, rcond=None)
                size.append(float(np.hypot(c[0], c[1])))
            left.plot(orders, size, colour, lw=1, label=label)
        right.plot(weak.integrate(m.w), weak.y, colour, ls="", marker=".", ms=1, label=label)
    linear = plant.plant.is_linear
    residual = "force residual [N]" if linear else "torque residual [N m]"
    left.set_xlabel("spatial frequency [rad/m]" if linear else "order [1/turn]")
    left.set_ylabel(f"{residual}, amplitude")
    right.set_xlabel("speed [m/s]" if linear else "speed [rad/s]")
    right.set_ylabel(residual)
    right.legend(fontsize="small", markerscale=6)
    return picture(
        "What the model lacks",
        f"{'Force' if linear else 'Torque'} that the model cannot account for, along the measured motion.",
        figure,
    )
