"""Contents of messages from what programs hold: one place, so that a live daemon and a replay write the same bits."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Protocol

import numpy as np

from ema.core.status import AlarmLevel, AlarmState, Lapse, LogState, Reason, ServiceState, Status


class NuisanceLike(Protocol):
    """What is logged of parameters estimated beside the faults (`ema.identification.nuisance.NuisanceEstimate`)."""

    @property
    def names(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def units(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def value(self) -> np.ndarray: ...  # noqa: D102
    @property
    def sd(self) -> np.ndarray: ...  # noqa: D102
    @property
    def interval95(self) -> np.ndarray: ...  # noqa: D102


class EstimateLike(Protocol):
    """What is logged of an estimate (`ema.identification.estimate.Estimate`)."""

    @property
    def method(self) -> str: ...  # noqa: D102
    @property
    def k(self) -> np.ndarray: ...  # noqa: D102
    @property
    def sd(self) -> np.ndarray: ...  # noqa: D102
    @property
    def p_value(self) -> float: ...  # noqa: D102
    @property
    def residual(self) -> np.ndarray: ...  # noqa: D102
    @property
    def status(self) -> Status: ...  # noqa: D102
    @property
    def reasons(self) -> Reason: ...  # noqa: D102
    @property
    def nuisance(self) -> NuisanceLike | None: ...  # noqa: D102


def estimate(t_ns: int, actuator: int, cycle: int, result: EstimateLike, age: float | None = None) -> dict[str, Any]:
    """Content of `schemas.ESTIMATE`; `t_ns` is the time of the cycle's last frame, so that replay gives the same.

    `age` is that at the sending [s]; a replay sends nothing.
    """
    return {
        "t_ns": int(t_ns),
        "actuator": int(actuator),
        "method": result.method,
        "cycle": int(cycle),
        "status": Status(result.status).name.lower(),
        "reasons": Reason(result.reasons).names,
        "k": result.k.tolist(),
        "sd": result.sd.tolist(),
        "p_value": float(result.p_value),
        "residual": rms(result.residual),
        "age": age,
    }


def nuisance(t_ns: int, actuator: int, cycle: int, result: EstimateLike) -> list[dict[str, Any]]:
    """Contents of `schemas.NUISANCE`, one for each parameter estimated beside the faults."""
    beside = result.nuisance
    if beside is None:
        return []
    columns = zip(beside.names, beside.units, beside.value, beside.sd, beside.interval95, strict=True)
    return [
        {
            "t_ns": int(t_ns),
            "actuator": int(actuator),
            "method": result.method,
            "cycle": int(cycle),
            "status": Status(result.status).name.lower(),
            "parameter": name,
            "unit": unit,
            "value": float(value),
            "sd": float(sd),
            "low": float(low),
            "high": float(high),
        }
        for name, unit, value, sd, (low, high) in columns
    ]


def rms(residual: np.ndarray) -> float | None:
    """Root mean square over what is not NaN; None when nothing is."""
    seen = residual[np.isfinite(residual)]
    return float(np.sqrt(np.mean(seen**2))) if seen.size else None


def envelope(
    t_ns: int, actuator: int, cycle: int, t: np.ndarray, measured: np.ndarray, model: np.ndarray, sd: np.ndarray
) -> dict[str, Any]:
    """Content of `schemas.ENVELOPE`; arrays of shape (n_omega,), NaN where there is nothing."""
    return {
        "t_ns": int(t_ns),
        "actuator": int(actuator),
        "cycle": int(cycle),
        "t": t,
        "measured": measured,
        "model": model,
        "sd": sd,
    }


def event(t_ns: int, level: str, code: str, text: str, actuator: int | None = None) -> dict[str, Any]:
    """Content of `schemas.EVENT`; `level` is info, warning or error, `code` a short name of the kind of event."""
    return {"t_ns": int(t_ns), "level": level, "code": code, "text": text, "actuator": actuator}


class AlarmLike(Protocol):
    """What is logged of an alarm (`ema.alarms.Change`)."""

    @property
    def t_ns(self) -> int: ...  # noqa: D102
    @property
    def actuator(self) -> int | None: ...  # noqa: D102
    @property
    def cause(self) -> str: ...  # noqa: D102
    @property
    def level(self) -> AlarmLevel: ...  # noqa: D102
    @property
    def state(self) -> AlarmState: ...  # noqa: D102
    @property
    def since_cycle(self) -> int: ...  # noqa: D102
    @property
    def since_ns(self) -> int: ...  # noqa: D102
    @property
    def measure(self) -> tuple[float, float, float, float]: ...  # noqa: D102
    @property
    def shelved_until_ns(self) -> int: ...  # noqa: D102


def alarm(change: AlarmLike, text: str) -> dict[str, Any]:
    """Content of `schemas.ALARM`; `text` is one line for a person."""
    return {
        "t_ns": change.t_ns,
        "actuator": change.actuator,
        "cause": change.cause,
        "level": change.level.name.lower(),
        "state": change.state.name.lower(),
        "since_cycle": change.since_cycle,
        "since_ns": change.since_ns,
        **dict(zip(("value", "low", "high", "limit"), change.measure, strict=True)),
        "shelved_until_ns": change.shelved_until_ns,
        "text": text,
    }


def status(
    t_ns: int,
    state: ServiceState,
    uptime: float,
    log_state: LogState,
    log_free: float,
    counters: Mapping[str, int],
    lapses: Iterable[tuple[Lapse, int | None, str]] = (),
) -> dict[str, Any]:
    """Content of `schemas.STATUS`; `uptime` [s], `log_free` [B], `lapses`: what, of which actuator, of which method."""
    return {
        "t_ns": int(t_ns),
        "state": ServiceState(state).name.lower(),
        "uptime": float(uptime),
        "log_state": LogState(log_state).name.lower(),
        "log_free": float(log_free),
        "lapses": [
            {"reason": lapse.name.lower(), "actuator": actuator, "subject": subject}
            for lapse, actuator, subject in lapses
        ],
        "counters": {name: int(count) for name, count in counters.items()},
    }
