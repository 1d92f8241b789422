"""Pictures of an examination: where measured and simulated cycles differ, before and after."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ema.core.records import Array
from ema.discrepancy.actuator.fitting.leave_out import settled
from ema.discrepancy.actuator.fitting.model import FINAL_SEED, N_FINAL
from ema.discrepancy.actuator.reading.features import GROUPS, SECTORS
from ema.discrepancy.actuator.reading.thinning import choose_evenly
from ema.discrepancy.actuator.reading.weak import ORDERS, Torque, line, share_explained, torque
from ema.discrepancy.actuator.simulating.plant import ENVELOPE_STEP
from ema.discrepancy.plant import Point
from ema.discrepancy.report import Picture, picture
from ema.effects.base import T_REFERENCE

if TYPE_CHECKING:
    from ema.discrepancy.actuator.examine import Examination

N_SHOWN = 3  # cycles side by side
BEFORE, AFTER, NOISE = "#c0392b", "#1f6fb2", "#b9bec6"


def pictures(e: Examination) -> list[Picture]:
    """All pictures of the report."""
    cycles = _shown(e)
    points = [e.before.fit.point] + ([e.after.fit.point] if e.after is not e.before else [])
    torques = [_torques(e, point) for point in points]
    return [
        _envelope(e, cycles, points),
        _dependence(torques),
        _spectrum(e, torques),
        _phases(e, points),
        _groups(e),
        *_temperature(e, torques),
    ]


def _shown(e: Examination) -> list[int]:
    """A held-out cycle of each motion that has one; of many motions a few, spread over the record."""
    motions = e.search.plant.data.motion
    first = {int(motions[c]): c for c in reversed(e.search.heldout)}
    return choose_evenly(np.array(sorted(first.values())), N_SHOWN).tolist()


def _title(label: str) -> str:
    """File and cycle of a cycle's label."""
    record, _, cycle = label.rpartition(": ")
    return f"{Path(record).stem[-24:]}, {cycle}" if record else cycle


def _labels(points: Sequence[Point]) -> list[tuple[str, str]]:
    return [("faults only", BEFORE), ("with what was found", AFTER)][: len(points)]


def _envelope(e: Examination, cycles: list[int], points: list[Point]) -> Picture:
    plant = e.search.plant
    figure = Figure(figsize=(9.0, 4.6), layout="constrained")
    axes = figure.subplots(2, len(cycles), squeeze=False, sharex="col")
    for column, c in enumerate(cycles):
        measured = plant.data.envelopes[c][::ENVELOPE_STEP]
        t = np.arange(len(measured)) * ENVELOPE_STEP / plant.plant.control.rate
        top, bottom = axes[:, column]
        top.plot(t, measured, "k", lw=1.6, label="measured")
        sd = e.search.noise.of(c).envelope_sd
        bottom.fill_between(t, -2 * sd, 2 * sd, color=NOISE, lw=0, label="switching noise, ±2σ")
        for point, (label, colour) in zip(points, _labels(points), strict=True):
            mean = plant.repeated([point], [c], N_FINAL, FINAL_SEED)[0][c].envelopes.mean(axis=0)
            top.plot(t, mean, color=colour, lw=0.8, label=label)
            bottom.plot(t, measured - mean, color=colour, lw=0.8)
        largest = np.abs(np.array(bottom.lines[0].get_ydata(), dtype=float)[settled(plant) : -2]).max()
        bottom.set_ylim(-1.2 * largest, 1.2 * largest)
        top.set_title(_title(plant.data.labels[c]), fontsize=9)
        bottom.set_xlabel("t [s]")
    axes[0, 0].set_ylabel("envelope [A]")
    axes[1, 0].set_ylabel("measured less\nsimulated [A]")
    axes[0, -1].legend(fontsize=8, loc="upper left")
    axes[1, -1].legend(fontsize=8, loc="upper left")
    return picture("Envelope current in time", "Held-out cycles, which no parameter was fitted on.", figure)


def _torques(e: Examination, point: Point) -> list[Torque]:
    plant = e.search.plant
    found = []
    means = plant.means([point], range(plant.data.n_cycles), N_FINAL, FINAL_SEED)[0]
    for c, mean in means.items():
        at = plant.slices[int(plant.data.motion[c])]["torque"]
        r = plant.data.y[c] - mean
        found.append(torque(plant.data.signals[c], r[at], e.search.noise.of(c).sd[at], plant.plant.control.rate))
    return found


def _dependence(torques: list[list[Torque]]) -> Picture:
    figure = Figure(figsize=(9.0, 5.6))
    axes = figure.subplots(2, 2)
    quantities = (
        ("rotor angle, one turn [rad]", lambda c: c.averaged(c.theta_m) % (2.0 * np.pi)),
        ("speed [rad/s]", lambda c: c.averaged(c.w_m)),
        ("user position [mrad]", lambda c: 1e3 * c.averaged(c.theta_u)),
        ("motor current [A]", lambda c: c.current),
    )
    for ax, (name, quantity) in zip(axes.flat, quantities, strict=True):
        for cycles, colour in zip(torques, (BEFORE, AFTER), strict=False):
            x = np.concatenate([quantity(c) for c in cycles])
            y = np.concatenate([c.r for c in cycles])
            ax.plot(x, 1e3 * y, ".", ms=1.5, color=colour, alpha=0.25)
            middle, mean = _binned(x, y)
            ax.plot(middle, 1e3 * mean, color=colour, lw=1.8)
        ax.set_xlabel(name)
        ax.xaxis.set_major_locator(MaxNLocator(6))
        ax.set_ylabel("residual torque [mN m]")
        ax.axhline(0.0, color="k", lw=0.5)
        every = np.concatenate([c.r for c in torques[0]])
        limit = 1.3e3 * float(np.quantile(np.abs(every), 0.99))
        ax.set_ylim(-limit, limit)
    figure.tight_layout()
    return picture(
        "Residual torque",
        "Motor torque less inertia, viscous and simulated friction torque: dots are averages over 1 ms of all cycles, "
        "lines their mean; red with faults only, blue with what was found.",
        figure,
    )


def _binned(x: Array, y: Array, n: int = 40) -> tuple[Array, Array]:
    edges = np.linspace(x.min(), x.max(), n + 1)
    index = np.clip(np.digitize(x, edges) - 1, 0, n - 1)
    count = np.bincount(index, minlength=n)
    used = count > 3
    return (0.5 * (edges[1:] + edges[:-1]))[used], (np.bincount(index, y, minlength=n)[used] / count[used])


def _spectrum(e: Examination, torques: list[list[Torque]]) -> Picture:
    figure = Figure(figsize=(9.0, 3.0))
    left, right = figure.subplots(1, 2)
    orders = ORDERS[::2]
    for cycles, colour in zip(torques, (BEFORE, AFTER), strict=False):
        lines = [float(np.hypot(*share_explained(cycles, line(order))[1])) for order in orders]
        left.plot(orders, 1e3 * np.array(lines), color=colour, lw=0.9)
        n = min(len(c.r) for c in cycles)
        power = np.mean([np.abs(np.fft.rfft(c.r[:n] * np.hanning(n))) ** 2 for c in cycles], axis=0)
        rate = e.search.plant.plant.control.rate / cycles[0].m
        right.semilogy(np.fft.rfftfreq(n, 1.0 / rate), 1e3 * np.sqrt(power / n), color=colour, lw=0.9)
    left.set_xlabel("order [1/rotor turn]")
    left.set_ylabel("torque line [mN m]")
    right.set_xlabel("frequency [Hz]")
    right.set_ylabel("residual torque [mN m]")
    figure.tight_layout()
    p = e.search.plant.plant.motor.p
    return picture(
        "Orders and frequencies of the residual torque",
        f"Left against rotor angle (an electrical turn is order {p}), right against time.",
        figure,
    )


def _phases(e: Examination, points: list[Point]) -> Picture:
    plant = e.search.plant
    figure = Figure(figsize=(9.0, 2.8))
    axes = figure.subplots(1, 3, sharey=True)
    centre = (np.arange(SECTORS) + 0.5) * 360.0 / SECTORS
    for point, (label, colour) in zip(points, _labels(points), strict=True):
        means = plant.means([point], range(plant.data.n_cycles), N_FINAL, FINAL_SEED)[0]
        at = {c: plant.slices[int(plant.data.motion[c])]["phase"] for c in means}
        mean = np.mean([(plant.data.y[c] - x)[at[c]].reshape(2, 3, SECTORS) for c, x in means.items()], axis=0)
        for j, ax in enumerate(axes):
            ax.plot(centre, 1e3 * mean[0, j], color=colour, lw=1.2, label=label)
            ax.plot(centre, 1e3 * mean[1, j], color=colour, lw=1.0, ls=":")
            ax.set_title(f"phase {'ABC'[j]}", fontsize=9)
            ax.set_xlabel("electrical angle of the phase [°]")
    axes[0].set_ylabel("residual current [mA]")
    axes[0].legend(fontsize=8)
    figure.tight_layout()
    return picture(
        "Residual phase currents by electrical angle",
        "Mean over all cycles; solid as measured, dotted times the sign of the motor current.",
        figure,
    )


def _groups(e: Examination) -> Picture:
    figure = Figure(figsize=(9.0, 2.6))
    ax = figure.subplots()
    names = list(e.verdict_before.scores)
    for offset, (v, colour) in enumerate(((e.verdict_before, BEFORE), (e.verdict_after, AFTER))):
        values = [max(float(v.scores[name]), 0.1) for name in names]
        ax.bar(np.arange(len(names)) + 0.4 * offset, values, 0.38, color=colour)
    ax.set_yscale("log")
    ax.set_ylim(0.5, None)
    ax.axhline(3.0, color="k", lw=0.7, ls="--")
    ax.set_xticks(np.arange(len(names)) + 0.2, names)
    ax.set_ylabel("standard deviations\nabove noise")
    units = ", ".join(f"{name} [{unit}]" for name, (_, _, unit) in GROUPS.items())
    return picture(
        "Where in the actuator the residual stands out",
        f"Squared residual of each balance against what switching noise makes of it ({units}); dashed: 3σ.",
        figure,
    )


def _temperature(e: Examination, torques: list[list[Torque]]) -> list[Picture]:
    data = e.search.plant.data
    if not data.has_temperature or np.ptp(data.dT) == 0.0:
        return []
    figure = Figure(figsize=(5.0, 2.8))
    ax = figure.subplots()
    for cycles, colour in zip(torques, (BEFORE, AFTER), strict=False):
        ax.plot(data.dT + T_REFERENCE, [1e3 * float(np.sqrt(np.mean(c.r**2))) for c in cycles], "o", color=colour)
    ax.set_xlabel("winding temperature [°C]")
    ax.set_ylabel("residual torque, rms [mN m]")
    return [picture("Residual against temperature", "One dot for each cycle.", figure)]
