"""False alarms and delays of the alarms as shipped, and the curve that their setpoints were chosen from.

    python -m benchmarks alarms                         in the bench's table; flights are simulated once and kept
    python -m benchmarks.alarms docs/pictures/alarms.svg    the curve as a table and a picture

Healthy actuators differ from the bundle by a spread (`_alarm_flights.py`): their alarms are false. The delay is counted
from the step, or from the cycle in which the growing fault passes the setpoint, to the alarm.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ema.alarms import Alarms, AlarmSettings, Judged, Warmth
from ema.alarms.causes import CAUSES, Kind
from ema.alarms.condition import Condition
from ema.alarms.settings import Persistence
from ema.alarms.trend import ROOM
from ema.bundle import Bundle
from ema.core import config, resources
from ema.core.names import FAULTS
from ema.core.status import AlarmLevel, AlarmState, Reason, Status

from ._alarm_flights import (
    EPOCH_NS,
    GROWTH,
    N_GROWTH,
    PERIOD,
    SEED,
    SPREADS,
    STEP_AT,
    STEPS,
    Flight,
    Flown,
    flown,
    growths,
    healthy,
    shortened,
    steps,
)
from .identification import quick_bundle

SETPOINTS = (0.02, 0.03, 0.04, 0.05, 0.06, 0.08, 0.1)
PERSISTENCES = ((1, 1), (2, 3), (3, 5), (5, 8))
HOUR = 3600.0 / PERIOD  # cycles


class Raised(NamedTuple):
    """An alarm came."""

    lane: int
    cycle: int
    cause: str
    level: AlarmLevel


def raised(flight: Flight, seen: Flown, settings: AlarmSettings) -> list[Raised]:
    """Every alarm of a flight, by the engine of the daemon."""
    n_cycles, n_lanes = seen.status.shape
    alarms = Alarms(settings, range(n_lanes))
    found = []
    for cycle in range(n_cycles):
        t_ns = EPOCH_NS + round(cycle * PERIOD * 1e9)
        for lane in range(n_lanes):
            alarms.hear(Warmth(t_ns, lane, ROOM + flight.warming * cycle / n_cycles))
            status, reasons = Status(int(seen.status[cycle, lane])), Reason(int(seen.reasons[cycle, lane]))
            judged = Judged(t_ns, lane, cycle, seen.k[cycle, lane], seen.sd[cycle, lane], status, reasons)
            found += [
                Raised(lane, cycle, c.cause, c.level) for c in alarms.estimate(judged) if c.state == AlarmState.ACTIVE
            ]
    return found


def onsets(low: np.ndarray, setpoint: float, persistence: Persistence, hysteresis: float) -> list[int]:
    """Cycles in which the condition of one setpoint comes, for lower ends of consecutive cycles, shape (n,)."""
    condition = Condition((setpoint, np.inf), persistence, hysteresis)
    levels = [condition.update(float(x)) for x in low]
    return [n for n, (a, b) in enumerate(zip([AlarmLevel.NONE, *levels[:-1]], levels, strict=True)) if b > a]


def curve(bundle: Bundle, settings: AlarmSettings) -> list[dict[str, Any]]:
    """False alarms and delays by setpoint and persistence, of the faults' own conditions."""
    quiet = [(f, flown(f, bundle)) for f in healthy()]
    stepped = [(f, flown(f, bundle)) for f in steps()]
    grown = [(f, flown(f, bundle)) for f in growths()]
    found = []
    for m, n in PERSISTENCES:
        persistence = Persistence(m=m, n=n)
        for setpoint in SETPOINTS:
            how = setpoint, persistence, settings
            false = {f.name: sum(len(x) for x in _each(seen, *how).values()) for f, seen in quiet}
            actuators = {f.name: len({lane for (lane, _), x in _each(seen, *how).items() if x}) for f, seen in quiet}
            found.append(
                {
                    "m": m, "n": n, "setpoint": setpoint, "false": false, "actuators": actuators,
                    "step": _step_delays(stepped, *how), "growth": _growth_lags(grown, *how),
                }
            )  # fmt: skip
    return found


def _each(
    seen: Flown, setpoint: float, persistence: Persistence, settings: AlarmSettings
) -> dict[tuple[int, str], list[int]]:
    """Onsets by lane and fault."""
    low = seen.k - settings.deviations * seen.sd
    return {
        (lane, fault): onsets(low[:, lane, j], setpoint, persistence, settings.hysteresis)
        for lane in range(low.shape[1])
        for j, fault in enumerate(FAULTS)
    }


def _step_delays(
    flights: Iterable[tuple[Flight, Flown]], setpoint: float, persistence: Persistence, settings: AlarmSettings
) -> list[float]:
    """Cycles from the step to the alarm, of steps to at least 1.5 setpoints; infinite where none comes."""
    delays = []
    for flight, seen in flights:
        each = _each(seen, setpoint, persistence, settings)
        for lane, (fault, points) in enumerate(flight.faults):
            if points[-1][1] >= 1.5 * setpoint:
                after = [n for n in each[lane, fault] if n >= STEP_AT]
                delays.append(float(after[0] - STEP_AT + 1) if after else np.inf)
    return delays


def _growth_lags(
    flights: Iterable[tuple[Flight, Flown]], setpoint: float, persistence: Persistence, settings: AlarmSettings
) -> list[float]:
    """k beyond the setpoint when the alarm of a growing fault comes; infinite where none comes."""
    lags = []
    for flight, seen in flights:
        each = _each(seen, setpoint, persistence, settings)
        for lane, (fault, _) in enumerate(flight.faults):
            came = each[lane, fault]
            lags.append(GROWTH * came[0] / N_GROWTH - setpoint if came else np.inf)
    return lags


def rows(most: int | None = None) -> list[dict[str, Any]]:
    """The bench's table; of each flight at most so many cycles."""
    bundle = quick_bundle()
    settings = config.load(resources.config("alarms.yaml"), AlarmSettings)
    table: list[dict[str, Any]] = []
    n_cycles = 0
    for flight in shortened(healthy(), most):
        seen = flown(flight, bundle)
        n_cycles += seen.status.size
        table += _false(flight, seen, raised(flight, seen, settings))
    table.append(_row("healthy cycles in all", n_cycles))
    return table + list(_delays(bundle, settings, most))


def _false(flight: Flight, seen: Flown, alarms: list[Raised]) -> Iterator[dict[str, Any]]:
    """False alarms of one healthy flight by kind, for each hour of test cycles, and how many actuators had one."""
    hours = seen.status.size / HOUR
    for kind in (Kind.FAULT, Kind.RATE, Kind.LIFE):
        for level in (AlarmLevel.WATCH, AlarmLevel.ALARM):
            own = [a for a in alarms if CAUSES[a.cause].kind is kind and a.level == level]
            what = f"{flight.name}: false {kind} at {level.name.lower()}"
            limit = 0.0 if level is AlarmLevel.ALARM and kind is Kind.FAULT else None
            yield _row(f"{what}, a cycle-hour", len(own) / hours, "1/h", limit)
            if own:
                yield _row(f"{what}, actuators of {seen.status.shape[1]}", len({a.lane for a in own}))
    doubted = float(np.mean((seen.reasons & int(Reason.MODEL_IN_DOUBT)) > 0))
    yield _row(f"{flight.name}: cycles with the model in doubt", doubted)


def _delays(bundle: Bundle, settings: AlarmSettings, most: int | None) -> Iterator[dict[str, Any]]:
    """Delays of the shipped setpoints, fault by fault, and alarms of other faults than the one that is there."""
    others: Counter[str] = Counter()
    for flight in shortened(steps(), most):
        seen = flown(flight, bundle)
        alarms = raised(flight, seen, settings)
        for lane, (fault, points) in enumerate(flight.faults):
            size = points[-1][1]
            mine = [a for a in alarms if a.lane == lane and a.cycle >= STEP_AT]
            others.update(a.level.name for a in mine if CAUSES[a.cause].kind is Kind.FAULT and a.cause != fault)
            for level, setpoint in zip(
                (AlarmLevel.WATCH, AlarmLevel.ALARM), settings.faults[fault].setpoints, strict=True
            ):
                came = [a.cycle - STEP_AT + 1 for a in mine if a.cause == fault and a.level >= level]
                if size >= 1.1 * setpoint:
                    name = f"step of {fault} to {size:g}, actuator {lane % 2}: cycles to {level.name.lower()}"
                    yield _row(name, float(came[0]) if came else np.inf, "cycles")
    for flight in shortened(growths(), most):
        alarms = raised(flight, flown(flight, bundle), settings)
        for j, fault in enumerate(FAULTS):
            for level, setpoint in zip(
                (AlarmLevel.WATCH, AlarmLevel.ALARM), settings.faults[fault].setpoints, strict=True
            ):
                lanes = [lane for lane, (name, _) in enumerate(flight.faults) if name == fault]
                came = [_first(alarms, lane, fault, level) for lane in lanes]
                late = [GROWTH * n / N_GROWTH - setpoint for n in came]
                yield _row(f"growth of {fault}: k beyond its {level.name.lower()} when told, worst", max(late))
            told = [_first(alarms, lane, f"{fault}_rate", AlarmLevel.WATCH) for lane in range(j, len(flight.faults), 6)]
            yield _row(
                f"growth of {fault}, {GROWTH / N_GROWTH * HOUR:.2g}/h: cycles to its rate, worst", max(told), "cycles"
            )
    for level in ("WATCH", "ALARM"):
        yield _row(
            f"{level.lower()} of a fault that is not there, beside one that is, of {len(STEPS) * 12}", others[level]
        )


def _first(alarms: list[Raised], lane: int, cause: str, level: AlarmLevel) -> float:
    return next((float(a.cycle) for a in alarms if (a.lane, a.cause) == (lane, cause) and a.level >= level), np.inf)


def _row(figure: str, value: float, unit: str = "1", limit: float | None = None) -> dict[str, Any]:
    return {"figure": figure, "value": value, "unit": unit, "limit": limit, "seed": SEED}


def draw(points: list[dict[str, Any]], path: Path) -> None:
    """Delay of the slow-growing fault against false alarms, a line for each persistence, a panel for each spread."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "ema"
    from matplotlib import pyplot as plt

    shown = [f"healthy-{spread:g}" for spread in SPREADS[1:]]
    figure, axes = plt.subplots(1, len(shown), figsize=(11, 3.6), sharey=True, layout="constrained")
    for axis, name in zip(axes, shown, strict=True):
        for (m, n), marker in zip(PERSISTENCES, "ov^s", strict=True):
            own = [p for p in points if (p["m"], p["n"]) == (m, n)]
            x = [p["actuators"][name] / 16 for p in own]
            y = [p["setpoint"] + float(np.median(p["growth"])) for p in own]
            axis.plot(x, y, marker=marker, label=f"{m} of {n}", alpha=0.8)
            if (m, n) == (3, 5):
                for point, u, v in zip(own, x, y, strict=True):
                    axis.annotate(
                        f"{point['setpoint']:g}", (u, v), xytext=(4, 4), textcoords="offset points", fontsize=8
                    )
        axis.set_title(f"actuators differ by {float(name.split('-')[1]):.1%}")
        axis.set_xlabel("healthy actuators with a false alarm [1]")
        axis.set_xlim(-0.03, 1.03)
    axes[0].set_ylabel("k when a growing fault is told, median [1]")
    axes[0].legend(title="cycles")
    figure.savefig(path, metadata={"Date": None})


def main(path: Path | None) -> None:
    settings = config.load(resources.config("alarms.yaml"), AlarmSettings)
    points = curve(quick_bundle(), settings)
    print("| m of n | setpoint | " + " | ".join(points[0]["false"]) + " | step, median/worst | growth, median/worst |")
    for p in points:
        false = " | ".join(f"{p['false'][name]} in {p['actuators'][name]}" for name in p["false"])
        step, growth = p["step"], p["growth"]
        delay = f"{np.median(step):g}/{max(step):g} | {np.median(growth):.3f}/{max(growth):.3f}"
        print(f"| {p['m']} of {p['n']} | {p['setpoint']:g} | {false} | {delay} |")
    if path is not None:
        draw(points, path)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
