"""Pictures of the report, as SVG text."""

from __future__ import annotations

import io
from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from ema.core.names import FAULTS

from .health import Health
from .history import ActuatorHistory, Series
from .report_settings import ReportSettings, Severity

_BLUE, _GREY = "#1f4e79", "#9aa5b1"
COLOURS = {Severity.OK: "#2e7d4f", Severity.WATCH: "#b8860b", Severity.WARNING: "#c75b12", Severity.ALARM: "#a61b1b"}
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


def trend(actuator: ActuatorHistory, health: Health, settings: ReportSettings, first_ns: int) -> str:
    """Every k over time: estimates with two standard deviations, thresholds, changes of severity, remaining life."""
    with matplotlib.rc_context(_STYLE):
        figure, axes = plt.subplots(2, 3, figsize=(10.2, 4.9), sharex=True, layout="constrained")
        scale, unit = _time_unit(max(int(s.t_ns[-1]) for s in actuator.series.values()) - first_ns)
        for index, (fault, ax) in enumerate(zip(FAULTS, axes.flat, strict=True)):
            for method, series in actuator.series.items():
                if method != health.method:
                    _dots(ax, series, index, first_ns, scale, method)
            top = 0.04
            if health.method:
                top = _band(ax, actuator.series[health.method], index, first_ns, scale, health.method)
            top = max(1.25 * top, 0.02)
            for severity, level in zip(list(Severity)[1:], settings.severity[fault].levels, strict=True):
                if level < top:
                    ax.axhline(level, color=COLOURS[severity], lw=0.9, ls=(0, (4, 3)))
                    ax.annotate(
                        severity.name.lower(), (1.0, level), xycoords=("axes fraction", "data"), ha="right",
                        va="bottom", color=COLOURS[severity], fontsize=7,
                    )  # fmt: skip
            for alarm in health.alarms:
                if alarm.fault == fault:
                    at = (alarm.t_ns - first_ns) / 1e9 / scale
                    ax.axvline(at, color=COLOURS[max(alarm.severity, alarm.before)], lw=0.8)
            meaning = next((f.meaning for f in health.faults if f.fault == fault), "")
            ax.set_title(f"{fault}  {meaning}", loc="left", fontweight="bold")
            ax.set_ylim(0, top)
        for ax in axes[1]:
            ax.set_xlabel(f"time since the log's beginning [{unit}]")
        axes[0, 0].legend(loc="upper left", fontsize=7, frameon=False)
        return _svg(figure)


def envelope(content: dict[str, Any]) -> str:
    """Envelope of one cycle at the schedule against the model, and the residual in standard deviations."""
    t, measured, model, sd = (_numbers(content[name]) for name in ("t", "measured", "model", "sd"))
    with matplotlib.rc_context(_STYLE):
        figure, (upper, lower) = plt.subplots(
            2, 1, figsize=(5.0, 3.6), sharex=True, height_ratios=[2.2, 1], layout="constrained"
        )
        upper.errorbar(t, measured, 2 * sd, fmt="o", ms=3, color=_BLUE, lw=0.8, label="measured ± 2 sd")
        upper.plot(t, model, "x", color=COLOURS[Severity.WARNING], ms=5, label="model at the estimate")
        upper.set_ylabel("envelope [A]")
        upper.legend(fontsize=7, frameon=False)
        lower.axhspan(-2, 2, color="#eef2f6")
        lower.axhline(0, color=_GREY, lw=0.8)
        lower.plot(t, (measured - model) / sd, "o", ms=3, color=_BLUE)
        lower.set_ylabel("residual / sd")
        lower.set_xlabel("time in the cycle [s]")
        return _svg(figure)


def _dots(ax: Any, series: Series, index: int, first_ns: int, scale: float, method: str) -> None:
    usable = np.flatnonzero(series.usable)
    usable = usable[:: max(1, len(usable) // _N_POINTS)]
    t = (series.t_ns[usable] - first_ns) / 1e9 / scale
    ax.plot(t, series.k[usable, index], ".", ms=2, color=_GREY, label=method)


def _band(ax: Any, series: Series, index: int, first_ns: int, scale: float, method: str) -> float:
    """Draw; the largest value drawn."""
    usable = series.usable
    t = (series.t_ns[usable] - first_ns) / 1e9 / scale
    k, sd = series.k[usable, index], series.sd[usable, index]
    if len(t) > _N_POINTS:  # medians of equal parts
        parts = np.array_split(np.arange(len(t)), _N_POINTS)
        t, k, sd = (np.array([np.median(column[part]) for part in parts]) for column in (t, k, sd))
    ax.fill_between(t, np.maximum(k - 2 * sd, 0), k + 2 * sd, color=_BLUE, alpha=0.18, lw=0, label=f"{method} ± 2 sd")
    ax.plot(t, k, color=_BLUE, lw=1.1, label=method)
    return float(np.nanmax(k + np.nan_to_num(2 * sd)))


def _time_unit(span_ns: int) -> tuple[float, str]:
    seconds = span_ns / 1e9
    return (1.0, "s") if seconds < 600 else (60.0, "min") if seconds < 4 * 3600 else (3600.0, "h")


def _numbers(values: list[float | None]) -> np.ndarray:
    return np.array([np.nan if value is None else value for value in values], float)


def _svg(figure: Figure) -> str:
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    plt.close(figure)
    return text.getvalue()
