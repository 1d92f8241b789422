"""What may act beside inertia, dry friction and drag: columns of the regression, with names, units and sentences.

Where a law has a shape (the speed over which friction falls, the order of a line), a family of laws stands side by
side, and its best member competes with other laws.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from ema.core.records import Array
from ema.effects.stribeck import fade

from .along import by_position
from .drifting import drift_laws
from .law import Acting, Among, Columns, Law, one
from .links import coupled_friction
from .memory import memory_laws
from .motion import Motion
from .units import LINEAR, ROTARY, Units

N_SPEEDS = 14  # members of a family
SHAPES = (-1.0, 0.0, 1.0)  # by which friction falls, see `ema.effects.stribeck`
SEEN_BOTH = 0.1  # share of the samples in which a drive must act each way
ROUNDING = 1e-9  # of the drive's torque: no load is less than this, where there is one


def laws(m: Motion, *, linear: bool) -> Iterator[Law]:
    """Every law that these motions can show."""
    u = LINEAR if linear else ROTARY
    moves = bool((~m.static).any())
    yield Law(
        "constant",
        "constant",
        "constant_load",
        lambda m, _: (np.ones(len(m.w)),),
        {"torque": u.torque},
        one("torque"),
        f"a constant {u.said} of {{torque:.3g}} {u.torque} against positive motion",
        "the same motion with the axis turned upside down, and the drive's current with the axis free",
        also=("asymmetric_friction", "drive_offset"),
    )
    if moves:
        yield from _by_speed(m, u)
        yield from drift_laws(m, u.torque, u.place)
        if m.has_position:
            yield from memory_laws(m, u.torque, u.place)
        if min(float(np.mean(m.drive > 0.0)), float(np.mean(m.drive < 0.0))) > SEEN_BOTH:
            yield _unequal_drive()
    if m.neighbour:
        yield from coupled_friction(u.torque)
    yield from _by_load(u)
    if m.has_position and float(np.ptp(m.theta)) > 0.0:
        yield from by_position(m, u, moves=moves, linear=linear)


def _by_speed(m: Motion, u: Units) -> Iterator[Law]:
    drag = f"{u.torque} s/{u.place}"
    if (m.direction > 0.0).any() and (m.direction < 0.0).any():
        yield Law(
            "viscous by direction",
            "viscous by direction",
            "viscous_by_direction",
            lambda m, _: (np.abs(m.w),),
            {"difference": drag},
            one("difference"),
            f"viscous friction differs by direction: {{difference:+.3g}} {drag} in positive, the opposite in negative",
            "constant speeds in both directions",
            is_friction=True,
        )
    square = f"{u.torque} s^2/{u.place}^2"
    yield Law(
        "quadratic drag",
        "quadratic drag",
        "quadratic_drag",
        lambda m, _: (m.w * np.abs(m.w),),
        {"coefficient": square},
        one("coefficient"),
        f"drag that grows with the square of speed, {{coefficient:.3g}} {square}",
        "constant speeds up to the highest",
        is_friction=True,
    )
    w = np.abs(m.w[m.direction != 0.0])
    if not w.size or np.quantile(w, 0.05) > 0.5 * w.max():
        return
    low, high = max(float(np.quantile(w, 0.02)), 0.005 * float(w.max())), 0.4 * float(w.max())
    for over in np.geomspace(low, high, N_SPEEDS) if high > low else ():
        yield from (_stribeck(float(over), shape, (low, high), u) for shape in SHAPES)


def _stribeck(over: float, shape: float, ends: tuple[float, float], u: Units) -> Law:
    """Friction that fades over a speed between `ends`, by a shape between the first and the last of `SHAPES`."""
    step = math.log(ends[1] / ends[0]) / (N_SPEEDS - 1)
    return Law(
        "stribeck",
        f"stribeck {over:.8g} {shape:.6g}",
        "stribeck",
        _falling(over, shape),
        {"more": u.torque, "speed": u.speed, "shape": "1"},
        one("more", speed=over, shape=shape),
        f"friction changes with speed, {{more:+.3g}} {u.torque} at rest, fading over {{speed:.3g}} {u.speed}",
        "slow motion at several constant speeds",
        is_friction=True,
        among=Among(
            np.array([math.log(over) / step, shape]),
            np.array([np.log(ends) / step, (SHAPES[0], SHAPES[-1])]),
            lambda at: _stribeck(math.exp(at[0] * step), float(at[1]), ends, u),
        ),
    )


def _falling(over: float, shape: float) -> Columns:
    """sign ω f(|ω|/ω_s), see `ema.effects.stribeck`."""
    return lambda m, _: (m.direction * fade(m.w, over, shape),)


BY_LOAD: Mapping[str, tuple[str, str]] = {
    "motor": ("load_friction", "the torque at the motor"),
    "load": ("output_load_friction", "the load and the inertia's torque"),
    "held": ("output_load_friction", "the load without inertia"),
    "both": ("output_load_friction", "motor torque and load together"),
}


def _by_load(u: Units) -> Iterator[Law]:
    for side, (name, what) in BY_LOAD.items():
        yield Law(
            "friction by load",
            f"friction by {side}",
            name,
            _share(side, 1),
            {"share": "1"},
            one("share", of_inertia=float(side == "load")),
            f"friction grows with {what}, by {{share:.3g}} of it",
            "the same motion with different loads",
            is_friction=True,
            needs_acting=True,
        )
        yield Law(
            "friction by square of load",
            f"friction by square of {side}",
            f"quadratic_{name}",
            _share(side, 2),
            {"per_torque": f"1/({u.torque})"},
            one("per_torque"),
            f"friction grows with the square of {what}, by {{per_torque:.3g}} of it per {u.torque}",
            "the same motion with different loads, or voltage beside current",
            also=("saturation",) if side == "motor" else (),  # what such a motor does not give grows alike
            is_friction=True,
            needs_acting=True,
        )


def _share(side: str, power: int) -> Columns:
    """sign ω |τ|^n"""

    def columns(m: Motion, acting: Acting) -> tuple[Array, ...]:
        torque = acting.motor + acting.held if side == "both" else getattr(acting, side)
        torque = np.where(np.abs(torque) > ROUNDING * np.abs(acting.motor).max(initial=0.0), torque, 0.0)
        return (m.direction * np.abs(torque) ** power,)

    return columns


def _unequal_drive() -> Law:
    return Law(
        "unequal drive",
        "unequal drive",
        "drive_unequal",
        lambda _, acting: (np.abs(acting.motor),),
        {"share": "1"},
        one("share"),
        "the drive gives another torque per current one way than the other, {share:+.2%} and the opposite",
        "the same motions with the drive's polarity reversed",
        needs_acting=True,
    )
