"""Library effects as candidates: bounds and starts from the sizes of torque, speed and position in the records."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ema.discrepancy.plant import Candidate, Free, Point
from ema.effects import registry
from ema.models.axis_config import LinearAxis

from .cogging import cogging_candidate
from .fading import fading_candidate
from .gear import gear_candidate
from .sizes import Sizes, sizes
from .stretch import stretch_candidate

if TYPE_CHECKING:
    from .measured import Measured

PRIOR = 0.5  # standard deviation of a fitted parameter about the plant file's value, relative
SHAPES = ("roundness",)  # of a law
BASE_RANGE = 20.0  # a fitted parameter stays within this factor of the plant file's value


def base(plant: Measured) -> tuple[Free, ...]:
    """Friction level, and the parameters the plant file names under `fitted`."""
    p, s = plant.plant, sizes(plant)
    unit = "N" if isinstance(p, LinearAxis) else "N m"
    free = [Free("F_d", unit, 0.0, 3.0 * s.torque, min(p.F_d, 2.9 * s.torque), 0.05 * s.torque, 1e-3 * s.torque)]
    for name in p.fitted:
        value = float(getattr(p, name))
        field = type(p).model_fields[name].json_schema_extra
        unit = str(field["unit"]) if isinstance(field, dict) else ""
        scale = value if value > 0.0 else 0.1 * s.torque / s.speed
        high = max(value, scale) * BASE_RANGE
        free.append(Free(name, unit, value / BASE_RANGE, high, value, 0.05 * scale, prior=PRIOR * scale))
    for record, zero in plant.zeros.items():
        if zero.angle:
            room = np.pi / max(zero.orders)
            free.append(Free(f"zero:{record}", "rad", zero.angle - room, zero.angle + room, zero.angle, 0.1 * room))
    return tuple(free)


def library(plant: Measured, point: Point, blocks: Sequence[int]) -> list[Candidate]:
    """Every effect of the library that has a meaning for this axis and its channels."""
    s = sizes(plant)
    found = [c for name in registry() if (c := _candidate(plant, s, name, point)) is not None]
    searched = (
        _clock_of_the_drive(plant, s, point),
        cogging_candidate(plant, point, blocks),
        gear_candidate(plant, point, blocks),
        stretch_candidate(plant, s, point, blocks),
        fading_candidate(plant, s, point, blocks),
    )
    return [*found, *(c for c in searched if c is not None)]


def _candidate(plant: Measured, s: Sizes, name: str, point: Point) -> Candidate | None:
    build = _BUILDERS.get(name)
    have = any(key.startswith(f"{name}.") for key in point)
    if build is None or have or "axis" not in registry()[name].plants:
        return None
    spec = build(plant, s)
    if spec is None:
        return None
    units = {p.name: p.unit for p in registry()[name].parameters}
    nominal = {**registry()[name].neutral(), **plant.plant.effects.get(name, {})}
    free = tuple(
        Free(f"{name}.{parameter}", units[parameter], low, high, start[0], scale, is_shape=parameter in SHAPES)
        for parameter, (low, high, start, scale) in spec.items()
    )
    grid: list[dict[str, float]] = [{}]
    for parameter, (_, _, starts, _) in spec.items():
        grid = [{**point_, f"{name}.{parameter}": value} for point_ in grid for value in starts]
    neutral = {f.name: nominal[f.name.removeprefix(f"{name}.")] for f in free[:1]}
    return Candidate(name, name, free, tuple(grid), neutral)


def _clock_of_the_drive(plant: Measured, s: Sizes, point: Point) -> Candidate | None:
    """A drive that is sampled by a clock of its own: what it is late by adds up from the record's start to its end."""
    name = "clock_skew.currents"
    moving = [w for w in plant.windows if not w.static]
    if not moving or any(key.startswith("clock_skew.") for key in point):
        return None
    sample = s.period / max(float(np.ptp(w.course[0])) for w in moving)  # of clock error, late by one at the end
    free = (Free(name, "1", -200.0 * sample, 200.0 * sample, sample, 0.2 * sample),)
    starts = tuple({name: x * sample} for x in (-5.0, -1.0, 1.0, 5.0))
    return Candidate("clock_skew of the drive", "clock_skew", free, starts, {name: 0.0})


# Each builder: parameter → (low, high, starts, scale); the first parameter is the one that switches the effect off.
_Spec = dict[str, tuple[float, float, Sequence[float], float]]


def _has(plant: Measured, channel: str) -> bool:
    return any(channel in b.roles.outputs for b in plant.benches)


def _rotary(plant: Measured) -> bool:
    return not isinstance(plant.plant, LinearAxis)


def _viscous(plant: Measured, s: Sizes) -> _Spec:
    c = s.torque / s.speed
    return {"coefficient": (-plant.plant.C, 3.0 * c, (0.05 * c,), 0.05 * c)}


def _quadratic(plant: Measured, s: Sizes) -> _Spec:
    c = s.torque / s.speed**2
    return {"coefficient": (0.0, 3.0 * c, (0.05 * c,), 0.05 * c)}


def _spring(plant: Measured, s: Sizes) -> _Spec | None:
    k = s.torque / s.half_range  # near a resonance it moves farther than the drive could hold it
    return {"stiffness": (-50.0 * k, 50.0 * k, (0.05 * k, 2.0 * k), 0.05 * k)}


def _flux(plant: Measured, s: Sizes) -> _Spec | None:
    if plant.plant.is_force:
        return None
    spec: _Spec = {"change": (-0.4, 0.4, (-0.02,), 0.02)}
    dT = [w.dT for w in plant.windows]
    if np.ptp(dT) > 5.0:
        spec["per_kelvin"] = (-0.004, 0.002, (-0.001,), 0.0005)
    return spec


def _resistance(plant: Measured, s: Sizes) -> _Spec | None:
    if not (_has(plant, "u_q") or plant.plant.drive == "voltage") or "R" in plant.plant.fitted:
        return None
    spec: _Spec = {"change": (-0.6, 2.0, (0.05,), 0.05)}
    if np.ptp([w.dT for w in plant.windows]) > 5.0:
        spec["per_kelvin"] = (0.0, 0.008, (0.0039,), 0.001)
    return spec


def _drop(plant: Measured, s: Sizes) -> _Spec | None:
    if not (_has(plant, "u_q") or plant.plant.drive == "voltage"):
        return None
    return {
        "voltage": (0.0, 0.5 * s.voltage, (0.02 * s.voltage,), 0.01 * s.voltage),
        "below": (0.0, s.current, (0.01 * s.current, 0.2 * s.current), 0.05 * s.current),
        "roundness": (0.0, 1.0, (0.5,), 0.5),
    }


def _sag(plant: Measured, s: Sizes) -> _Spec | None:
    U = plant.plant.V_dc
    if U is None or not (_has(plant, "u_q") or plant.plant.drive == "voltage"):
        return None
    R = U**2 / (s.voltage * s.current)  # at which nothing would be left of the supply
    return {"resistance": (0.0, 0.2 * R, (0.01 * R,), 0.01 * R)}


def _saturation(plant: Measured, s: Sizes) -> _Spec | None:
    if plant.plant.is_force:
        return None
    return {"emf": (0.0, 0.3 / s.current**2, (0.03 / s.current**2,), 0.02 / s.current**2)}


def _resolver(plant: Measured, s: Sizes) -> _Spec | None:
    if not _rotary(plant):
        return None
    parts = ("once_cosine", "once_sine", "twice_cosine", "twice_sine")
    return {name: (-0.2, 0.2, (1e-3,), 0.01) for name in parts}


def _encoder(plant: Measured, s: Sizes) -> _Spec | None:
    return _resolver(plant, s) if _has(plant, "theta_m") and _has(plant, "w_m") else None


def _speed_delay(plant: Measured, s: Sizes) -> _Spec | None:
    if not (_has(plant, "w_m") or _has(plant, "v")):
        return None
    return {"time": (0.0, 20.0 * s.period, (0.3 * s.period, 3.0 * s.period), 0.3 * s.period)}


def _position_delay(plant: Measured, s: Sizes) -> _Spec | None:
    if not (_has(plant, "theta_m") or _has(plant, "q")):
        return None
    return {"time": (0.0, 20.0 * s.period, (0.3 * s.period, 3.0 * s.period), 0.3 * s.period)}


def _inertia(plant: Measured, s: Sizes) -> _Spec | None:
    if {"J", "M"} & set(plant.plant.fitted) or all(w.static for w in plant.windows):
        return None
    return {"change": (-0.8, 4.0, (0.02,), 0.03)}


def _drive_gain(plant: Measured, s: Sizes) -> _Spec | None:
    return None if plant.plant.drive == "speed-loop" else {"gain": (-0.5, 1.0, (0.02,), 0.02)}


def _drive_offset(plant: Measured, s: Sizes) -> _Spec | None:
    if plant.plant.drive == "speed-loop":
        return None
    return {"offset": (-3.0 * s.drive, 3.0 * s.drive, (0.02 * s.drive,), 0.02 * s.drive)}


_BUILDERS: dict[str, Callable[[Measured, Sizes], _Spec | None]] = {
    "viscous_drag": _viscous,
    "quadratic_drag": _quadratic,
    "asymmetric_friction": lambda plant, s: {"asymmetry": (-0.95, 0.95, (0.1,), 0.05)},
    "load_friction": lambda plant, s: {"per_torque": (0.0, 20.0 / s.torque, (0.2 / s.torque,), 0.1 / s.torque)},
    "constant_load": lambda plant, s: {
        "torque": (-3.0 * s.torque, 3.0 * s.torque, (0.02 * s.torque,), 0.02 * s.torque)
    },
    "spring_load": _spring,
    "magnet_flux": _flux,
    "winding_resistance": _resistance,
    "inverter_drop": _drop,
    "supply_sag": _sag,
    "saturation": _saturation,
    "resolver_error": _resolver,
    "encoder_error": _encoder,
    "speed_delay": _speed_delay,
    "position_delay": _position_delay,
    "clock_skew": lambda plant, s: {"rate": (-0.05, 0.05, (0.002,), 0.002)},
    "inertia": _inertia,
    "drive_gain": _drive_gain,
    "drive_offset": _drive_offset,
}
