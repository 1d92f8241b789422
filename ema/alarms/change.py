"""What is told when an alarm changes, and in which words."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ema.core.status import AlarmLevel, AlarmState

from .causes import CAUSES, Cause, Kind


class Measure(NamedTuple):
    """What an alarm is judged by: a value with its interval, and the setpoint of its level; NaN where there is none."""

    value: float = np.nan
    low: float = np.nan
    high: float = np.nan
    limit: float = np.nan


class Change(NamedTuple):
    """An alarm as it is after a change. `actuator` is None where it is the monitor's."""

    t_ns: int
    actuator: int | None
    cause: str
    level: AlarmLevel
    state: AlarmState
    since_cycle: int
    since_ns: int
    measure: Measure
    shelved_until_ns: int = 0


def said(change: Change) -> str:
    """One line for a person."""
    cause = CAUSES[change.cause]
    whose = "monitor" if change.actuator is None else f"actuator {change.actuator}"
    head = f"{whose}: {change.level.name.lower() if change.level else 'no alarm'}, {cause.name} ({cause.meaning})"
    parts = [change.state.name.lower().replace("_", "-")]
    if change.level:
        parts += [measured(cause, change.measure)] if measured(cause, change.measure) else []
        parts += [f"since cycle {change.since_cycle}"] if cause.kind is not Kind.SUPERVISION else []
    return f"{head}: {', '.join(parts)}"


def measured(cause: Cause, m: Measure) -> str:
    """The quantity judged, in words; empty where there is none."""
    if cause.kind is Kind.FAULT and np.isfinite(m.value):
        return f"k = {m.value:.3f}, at least {max(m.low, 0.0):.3f} (limit {m.limit:g})"
    if cause.kind is Kind.RATE and np.isfinite(m.value):
        return f"grows by {m.value:.3g}/h, at least {m.low:.3g}/h (limit {m.limit:g}/h)"
    if cause.kind is Kind.LIFE and np.isfinite(m.low):
        latest = f"{m.high:.3g}" if np.isfinite(m.high) else "∞"
        return (
            f"at the present rate {cause.fault} passes its alarm level in {m.low:.3g}…{latest} h (limit {m.limit:g} h)"
        )
    return ""
