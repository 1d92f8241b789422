"""Pictures of the report, as SVG text."""

from __future__ import annotations

import io
from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from ema.core.names import FAULT_MEANING, FAULTS

from .health import Health
from .history import ActuatorHistory
from .report_settings import ReportSettings, Severity
from .series import Points

_BLUE, _GREY = "#1f4e79", "#9aa5b1"
COLOURS = {Severity.OK: "#2e7d4f", Severity.WATCH: "#b8860b", Severity.ALARM: "#a61b1b"}
_N_POINTS = 300  # drawn of a series
_STYLE: Any = {
    "font.size": 8,
    "font.family": "DejaVu Sans",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e8ec",
    "grid.linewidth": 0.6,
    "svg.hashsalt": "ema",  # the same picture, the same text
}


def trend(actuator: ActuatorHistory, health: Health, settings: ReportSettings) -> str:
    """Every k over time of operation: estimates ± two standard deviations, thresholds, changes of severity, breaks."""
    with matplotlib.rc_context(_STYLE):
        figure, axes = plt.subplots(2, 3, figsize=(10.2, 4.9), sharex=True, layout="constrained")
        drawn = {method: series.points for method, series in actuator.series.items() if series.last is not None}
        scale, unit = _time_unit(max((float(points.t_op[-1]) for points in drawn.values()), default=0.0))
        for index, (fault, ax) in enumerate(zip(FAULTS, axes.flat, strict=True)):
            for method, points in drawn.items():
                if method != health.method:
                    _dots(ax, points, index, scale, method)
            top = 0.04
            if health.method:
                top = _band(ax, drawn[health.method], index, scale, health.method)
            top = max(1.25 * top, 0.02)
            for severity, level in zip(list(Severity)[1:], settings.alarms.faults[fault].setpoints, strict=True):
                if level < top:
                    ax.axhline(level, color=COLOURS[severity], lw=0.9, ls=(0, (4, 3)))
                    ax.annotate(
                        severity.name.lower(), (1.0, level), xycoords=("axes fraction", "data"), ha="right",
                        va="bottom", color=COLOURS[severity], fontsize=7,
                    )  # fmt: skip
            for change in health.changes:
                if change.fault == fault:
                    ax.axvline(change.t_op / scale, color=COLOURS[max(change.severity, change.before)], lw=0.8)
            for at, _ in actuator.operating.breaks:
                ax.axvline(at / scale, color=_GREY, lw=0.8, ls=":")
            ax.set_title(f"{fault}  {FAULT_MEANING[fault]}", loc="left", fontweight="bold")
            ax.set_ylim(0, top)
        for ax in axes[1]:
            ax.set_xlabel(f"time of operation [{unit}]")
        if drawn:
            axes[0, 0].legend(loc="upper left", fontsize=7, frameon=False)
        return _svg(figure)


def beside(actuator: ActuatorHistory) -> str:
    """Every parameter estimated beside the faults over time, with two standard deviations."""
    names = sorted({name for _, name in actuator.beside})
    with matplotlib.rc_context(_STYLE):
        figure, axes = plt.subplots(1, len(names), figsize=(10.2, 2.2), layout="constrained", squeeze=False)
        first_ns = min(one.t_ns[0] for one in actuator.beside.values())
        last_ns = max(one.t_ns[-1] for one in actuator.beside.values())
        scale, unit = _time_unit((last_ns - first_ns) / 1e9)
        for name, ax in zip(names, axes[0], strict=True):
            for (method, parameter), one in sorted(actuator.beside.items()):
                if parameter != name:
                    continue
                t, value, sd = (np.array(x, float) for x in (one.t_ns, one.value, one.sd))
                at = (t - first_ns) / 1e9 / scale
                (drawn,) = ax.plot(at, value, ".-", ms=3, lw=0.8, label=f"{method} ± 2 sd")
                ax.fill_between(at, value - 2 * sd, value + 2 * sd, color=drawn.get_color(), alpha=0.15, lw=0)
            ax.set_title(name, loc="left", fontweight="bold")
            ax.set_xlabel(f"time since the first estimate [{unit}]")
            ax.legend(fontsize=7, frameon=False)
        return _svg(figure)


def envelope(content: dict[str, Any]) -> str:
    """Envelope of one cycle at the schedule against the model, and the residual in standard deviations."""
    t, measured, model, sd = (_numbers(content[name]) for name in ("t", "measured", "model", "sd"))
    with matplotlib.rc_context(_STYLE):
        figure, (upper, lower) = plt.subplots(
            2, 1, figsize=(5.0, 3.6), sharex=True, height_ratios=[2.2, 1], layout="constrained"
        )
        upper.errorbar(t, measured, 2 * sd, fmt="o", ms=3, color=_BLUE, lw=0.8, label="measured ± 2 sd")
        upper.plot(t, model, "x", color="#c75b12", ms=5, label="model at the estimate")
        upper.set_ylabel("envelope [A]")
        upper.legend(fontsize=7, frameon=False)
        lower.axhspan(-2, 2, color="#eef2f6")
        lower.axhline(0, color=_GREY, lw=0.8)
        lower.plot(t, (measured - model) / sd, "o", ms=3, color=_BLUE)
        lower.set_ylabel("residual / sd")
        lower.set_xlabel("time in the cycle [s]")
        return _svg(figure)


def _dots(ax: Any, points: Points, index: int, scale: float, method: str) -> None:
    few = slice(None, None, max(1, len(points.t_op) // _N_POINTS))
    ax.plot(points.t_op[few] / scale, points.k[few, index], ".", ms=2, color=_GREY, label=method)


def _band(ax: Any, points: Points, index: int, scale: float, method: str) -> float:
    """Draw; the largest value drawn."""
    t, k, sd = points.t_op / scale, points.k[:, index], points.sd[:, index]
    if len(t) > _N_POINTS:  # medians of equal parts
        parts = np.array_split(np.arange(len(t)), _N_POINTS)
        t, k, sd = (np.array([np.median(column[part]) for part in parts]) for column in (t, k, sd))
    ax.fill_between(t, np.maximum(k - 2 * sd, 0), k + 2 * sd, color=_BLUE, alpha=0.18, lw=0, label=f"{method} ± 2 sd")
    ax.plot(t, k, color=_BLUE, lw=1.1, label=method)
    return float(np.nanmax(k + np.nan_to_num(2 * sd)))


def _time_unit(seconds: float) -> tuple[float, str]:
    return (1.0, "s") if seconds < 600 else (60.0, "min") if seconds < 4 * 3600 else (3600.0, "h")


def _numbers(values: list[float | None]) -> np.ndarray:
    return np.array([np.nan if value is None else value for value in values], float)


def _svg(figure: Figure) -> str:
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    plt.close(figure)
    return text.getvalue()
