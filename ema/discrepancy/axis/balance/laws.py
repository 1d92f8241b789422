"""What may act beside inertia, dry friction and drag: columns of the regression, with names, units and sentences.

Where a law has a shape (the speed over which friction falls, the order of a line), a family of laws stands side by
side, and its best member competes with other laws.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ema.core.records import Array

from .drifting import drifting
from .law import Acting, Columns, Law, Values, one
from .links import coupled_friction
from .memory import remembering
from .regression import BY_RECORD
from .rows import Motion

N_SPEEDS, N_PLACES, N_ORDERS = 14, 12, 320  # members of a family
SEEN_BOTH = 0.1  # share of the samples in which a drive must act each way
LEAST_TURN = 0.3  # [rad] of travel that shows a sine of the angle apart from a straight line
ROUNDING = 1e-9  # of the drive's torque: no load is less than this, where there is one
HIGHEST_ORDER = 260.0
STRETCHES = (0.05, 0.15)  # half widths of a stretch of other friction, of the travel
TORQUE_LINE, TRAVEL_LINE, GEAR_LINE = "torque line", "line along the travel", "line of the gear"
LINES = tuple(  # several may act
    f"{name}{more}" for name in (TORQUE_LINE, TRAVEL_LINE, GEAR_LINE) for more in ("", BY_RECORD)
)


@dataclass(frozen=True)
class Units:
    """Of torque, speed and place, and what a torque is called."""

    torque: str
    speed: str
    place: str
    said: str


ROTARY, LINEAR = Units("N m", "rad/s", "rad", "torque"), Units("N", "m/s", "m", "force")


def of_base(u: Units) -> Mapping[str, str]:
    """Units of inertia, dry friction and drag."""
    return {
        "inertia": "kg" if u is LINEAR else "kg m^2",
        "dry_friction": u.torque,
        "viscous_drag": f"{u.torque} s/{u.place}",
    }


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
        yield from drifting(m, u.torque, u.place)
        if m.has_position:
            yield from remembering(m, u.torque, u.place)
        if min(float(np.mean(m.drive > 0.0)), float(np.mean(m.drive < 0.0))) > SEEN_BOTH:
            yield _unequal_drive()
    if m.neighbour:
        yield from coupled_friction(u.torque)
    yield from _by_load(u)
    if m.has_position and float(np.ptp(m.theta)) > 0.0:
        yield from _by_position(m, u, moves=moves, linear=linear)


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
        for power in (1.0, 2.0):
            yield Law(
                "stribeck",
                f"stribeck {over:.3g} {power:g}",
                "stribeck",
                _falling(float(over), power),
                {"more": u.torque, "speed": u.speed, "shape": "1"},
                one("more", speed=float(over), shape=power - 1.0),
                f"friction changes with speed, {{more:+.3g}} {u.torque} at rest, fading over {{speed:.3g}} {u.speed}",
                "slow motion at several constant speeds",
                is_friction=True,
            )


def _falling(over: float, power: float) -> Columns:
    """sign ω exp(-|ω/ω_s|^δ)"""
    return lambda m, _: (m.direction * np.exp(-((np.abs(m.w) / over) ** power)),)


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
            one("share"),
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
            "the same motion with different loads",
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


def _by_position(m: Motion, u: Units, *, moves: bool, linear: bool) -> Iterator[Law]:
    span = float(np.ptp(m.theta))
    centre = 0.5 * float(m.theta.max() + m.theta.min())
    yield _spring(centre, u)
    if not linear and span > LEAST_TURN:
        yield _pendulum(u)
        yield Law(
            "friction once per turn",
            "friction once per turn",
            "friction_line",
            lambda m, _: (m.direction * np.cos(m.theta), m.direction * np.sin(m.theta)),
            {"amplitude": u.torque, "phase": "rad"},
            _of_line(0.0),
            f"friction varies by {{amplitude:.3g}} {u.torque} once per turn",
            "slow motion over several turns",
            is_friction=True,
            n_columns=2,
        )
    yield from _gear_lines(m, span, u)
    yield from _lines(span, u, linear=linear, but=m.gear_orders)
    yield Law(
        "friction along the travel",
        "friction along the travel",
        "friction_slope",
        lambda m, _: (m.direction * (m.theta - centre),),
        {"slope": f"{u.torque}/{u.place}"},
        one("slope", centre=centre),
        f"friction changes along the travel by {{slope:+.3g}} {u.torque} per {u.place}",
        "slow motion over the whole travel",
        is_friction=True,
    )
    if moves:
        drag = f"{u.torque} s/{u.place}"
        yield Law(
            "drag along the travel",
            "drag along the travel",
            "viscous_slope",
            lambda m, _: (m.w * (m.theta - centre),),
            {"slope": f"{u.torque} s/{u.place}^2"},
            one("slope", centre=centre),
            f"viscous friction changes along the travel by {{slope:+.3g}} {drag} per {u.place}",
            "fast motion in several places",
            is_friction=True,
        )
    for width in STRETCHES:
        for at in np.linspace(float(m.theta.min()), float(m.theta.max()), N_PLACES):
            yield Law(
                "stretch of friction",
                f"stretch {at:.4g} {width:g}",
                "position_friction",
                _stretch(float(at), width * span),
                {"more": u.torque, "centre": u.place, "width": u.place},
                one("more", centre=float(at), width=width * span),
                f"friction is {{more:+.3g}} {u.torque} other around {{centre:.3g}} {u.place} ± {{width:.2g}} {u.place}",
                "slow motion over the whole travel",
                is_friction=True,
            )


def _stretch(at: float, width: float) -> Columns:
    return lambda m, _: (m.direction * np.exp(-(((m.theta - at) / width) ** 2)),)


def _spring(centre: float, u: Units) -> Law:
    """k (θ - θ_0)"""

    def values(c: Array) -> Mapping[str, float]:
        return {"stiffness": float(c[0]), "zero": centre - float(c[1]) / (float(c[0]) or np.inf)}

    return Law(
        "spring",
        "spring",
        "spring_load",
        lambda m, _: (m.theta - centre, np.ones(len(m.theta))),
        {"stiffness": f"{u.torque}/{u.place}", "zero": u.place},
        values,
        f"a spring (or a cable) of {{stiffness:.3g}} {u.torque}/{u.place}, at rest at {{zero:.3g}} {u.place}",
        "slow motion over the whole travel",
        n_columns=2,
    )


def _line(order: float) -> Columns:
    return lambda m, _: (np.cos(order * m.theta), np.sin(order * m.theta))


def _of_line(order: float) -> Values:
    """Amplitude and phase:  c cos nθ + s sin nθ = A sin(nθ + φ)"""

    def values(c: Array) -> Mapping[str, float]:
        line = {"amplitude": float(np.hypot(*c)), "phase": float(np.arctan2(c[0], c[1]))}
        return {**line, "order": order} if order else line

    return values


def _pendulum(u: Units) -> Law:
    return Law(
        "pendulum",
        "pendulum",
        "pendulum",
        _line(1.0),
        {"amplitude": u.torque, "phase": "rad"},
        lambda c: {name: x for name, x in _of_line(1.0)(c).items() if name != "order"},
        f"gravity on a pendulum or an unbalanced load, {{amplitude:.3g}} {u.torque} once per turn",
        "the same motion with the shaft upright",
        n_columns=2,
    )


def _gear_lines(m: Motion, span: float, u: Units) -> Iterator[Law]:
    """Lines at orders of the gear; one that the motion does not tell from a whole number may be the motor's, too."""
    for n in m.gear_orders:
        if n * span < 2.0 * np.pi:
            continue
        whole = round(n) >= 1 and abs(n - round(n)) * span < np.pi
        yield Law(
            GEAR_LINE,
            f"gear line {n:.6g}",
            "gear_error",
            _line(n),
            {"amplitude": u.torque, "order": "1/turn", "phase": "rad"},
            _of_line(n),
            f"gear error: a {u.said} of {{amplitude:.3g}} {u.torque} with {{order:.5g}} periods per turn",
            "the motor alone, uncoupled from the gear; or the position at both sides of the gear",
            also=("cogging",) if whole else (),
            n_columns=2,
        )


def _lines(span: float, u: Units, *, linear: bool, but: tuple[float, ...]) -> Iterator[Law]:
    resolution = 2.0 * np.pi / span
    step = resolution if linear else max(1.0, float(np.ceil(resolution)))
    if not linear and span <= 2.0 * np.pi:
        return
    for n in np.arange(2.0 * (resolution if linear else 1.0), min(HIGHEST_ORDER * step, step * N_ORDERS), step):
        if n in but:
            continue  # stands among the gear's
        periods = f"once in {2.0 * np.pi / n:.3g} m of travel" if linear else "with {order:.4g} periods per turn"
        yield Law(
            TRAVEL_LINE if linear else TORQUE_LINE,
            f"line {n:.5g}",
            "position_line" if linear else "cogging",
            _line(float(n)),
            {"amplitude": u.torque, "order": "rad/m" if linear else "1/turn", "phase": "rad"},
            _of_line(float(n)),
            f"a {u.said} of {{amplitude:.3g}} {u.torque} {periods}",
            "slow motion over the whole travel" if linear else "slow motion over a full turn, with the drive off",
            n_columns=2,
        )
