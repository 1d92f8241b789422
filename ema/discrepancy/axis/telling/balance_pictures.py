"""Pictures of the balance: the drive's torque over time, and what is left against position, speed, load and time."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ema.core.records import Array
from ema.discrepancy.axis.balance.regressing.found import Balance
from ema.discrepancy.report import Picture, picture

N_BINS = 40
TURNS = 2.0  # of travel, from which the position is shown within one turn
GREY, BEFORE, AFTER, LAW = "0.35", "C1", "C0", "k"


def balance_pictures(b: Balance, *, linear: bool) -> list[Picture]:
    """Over time, and the residual before and after with what the laws make of it drawn in."""
    unit, what = ("N", "force") if linear else ("N m", "torque")
    laws = _of_laws(b)
    return [_over_time(b, laws, unit, what), _residuals(b, laws, unit, linear=linear)]


def _of_laws(b: Balance) -> Array:
    """What the laws that were found make, shape (n_rows,)."""
    n = len(b.model.base) + sum(law.n_columns for law in b.given)
    return np.asarray(b.model.design[:, n:] @ b.model.coefficients[n:])


def _over_time(b: Balance, laws: Array, unit: str, what: str) -> Picture:
    rows, m = b.model.rows, b.model.rows.motion
    t, after = rows.integrate @ m.t, rows.drive - b.model.left
    figure = Figure(figsize=(10, 2.4 * len(m.records) + 1.0))
    every = figure.subplots(len(m.records), 1, squeeze=False)[:, 0]
    for k, (axes, name) in enumerate(zip(every, m.records, strict=True)):
        own = np.flatnonzero(rows.record == k)
        own = own[np.argsort(t[own], kind="stable")]
        axes.plot(t[own], rows.drive[own], ".", color=GREY, ms=3, label="measured")
        axes.plot(t[own], after[own] - laws[own], color=BEFORE, lw=1, label="inertia, friction and drag")
        if laws.any():
            axes.plot(t[own], after[own], color=AFTER, lw=1, label="with the laws found")
        axes.set_title(name, fontsize="small", loc="left")
        axes.set_ylabel(f"{what} [{unit}]")
    every[-1].set_xlabel("t [s]")
    every[0].legend(loc="upper right", fontsize="small")
    figure.tight_layout()
    caption = f"The drive's {what} as recorded, and as the balance makes it of the measured motion."
    return picture(f"Measured and modelled {what} over time", caption, figure)


def _residuals(b: Balance, laws: Array, unit: str, *, linear: bool) -> Picture:
    rows, m = b.model.rows, b.model.rows.motion
    theta, place = m.theta, "position [m]" if linear else "position [rad]"
    if not linear and float(np.ptp(theta)) > TURNS * 2.0 * np.pi:
        theta, place = np.mod(theta, 2.0 * np.pi), "position within a turn [rad]"
    across = (
        (_at_centre(b, theta), place),
        (rows.integrate @ m.w, "speed [m/s]" if linear else "speed [rad/s]"),
        (rows.integrate @ b.model.acting.load, f"load [{unit}]"),
        (rows.integrate @ m.t, "t [s]"),
    )
    figure = Figure(figsize=(10, 6.4))
    for axes, (x, label) in zip(figure.subplots(2, 2).ravel(), across, strict=True):
        axes.plot(x, b.model.left + laws, ".", color=BEFORE, ms=2, label="before")
        if laws.any():
            axes.plot(x, b.model.left, ".", color=AFTER, ms=2, label="after")
            _draw(axes, x, laws)
        axes.axhline(0.0, color="0.7", lw=0.6)
        axes.set_xlabel(label)
        axes.set_ylabel(f"residual [{unit}]")
    figure.axes[0].legend(loc="upper right", fontsize="small", markerscale=4)
    figure.tight_layout()
    caption = "What inertia, friction and drag leave (before) and what the laws leave (after); " + (
        "the black line is what the laws make on average." if laws.any() else "no law was found."
    )
    return picture("What is left, against position, speed, load and time", caption, figure)


def _at_centre(b: Balance, x: Array) -> Array:
    """Of an angle within a turn no mean may be taken: its value where a row weighs most."""
    matrix = b.model.rows.integrate.tocsr()
    heaviest = np.array([
        matrix.indices[a:z][np.argmax(matrix.data[a:z])] for a, z in zip(matrix.indptr, matrix.indptr[1:], strict=False)
    ])  # fmt: skip
    return np.asarray(x[heaviest])


def _draw(axes: Axes, x: Array, y: Array) -> None:
    """Mean of y over bins of equal count."""
    order = np.argsort(x, kind="stable")
    parts = [part for part in np.array_split(order, N_BINS) if len(part)]
    axes.plot([x[part].mean() for part in parts], [y[part].mean() for part in parts], color=LAW, lw=1.4, label="laws")
