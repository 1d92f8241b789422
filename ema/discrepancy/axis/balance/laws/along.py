"""Laws by position: springs, pendulums, lines, and friction that differs along the travel."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from ema.core.records import Array
from ema.discrepancy.axis.naming.linear import in_metres
from ema.effects.flux_ripple import EFFECT as FLUX_RIPPLE
from ema.effects.friction_by_angle import EFFECT as FRICTION
from ema.effects.per_turn import LEAST_TRAVEL, ORDERS, PARTS
from ema.effects.position_friction import EFFECT as STRETCH
from ema.effects.position_friction import FORMS, fading
from ema.effects.position_line import EFFECT as POSITION_LINE
from ema.effects.stiffening_spring import EFFECT, bends, tilts

from .law import BY_RECORD, Acting, Columns, Law, Values, one
from .motion import Motion
from .units import LINEAR, Units

N_PLACES, N_ORDERS = 12, 320  # members of a family
LEAST_TURN = 0.3  # [rad] of travel that shows a sine of the angle apart from a straight line
HIGHEST_ORDER = 260.0
HIGHEST_RIPPLE = 96  # six per electrical turn, of 16 pole pairs
FEWEST_PERIODS = 2.0  # of a line within the travel
CLOSED = 0.1  # of a period: a map of one turn ends a step before it begins
STRETCHES = (0.05, 0.15, 0.3)  # half widths of a stretch of other friction, of the travel
GROWTHS = (0.3, 1.0, 1.3, 1.7, 2.2, 2.9, 3.7, 4.8)  # exponents from the middle of the travel to an end: what stiffens
N_POLYNOMIALS = 10  # of a torque along the travel that has no name
STIFFENING, ANY = "stiffening spring", "torque along the travel"
TORQUE_LINE, TRAVEL_LINE, GEAR_LINE = "torque line", "line along the travel", "line of the gear"
LINES = tuple(  # several may act
    f"{name}{more}" for name in (TORQUE_LINE, TRAVEL_LINE, GEAR_LINE) for more in ("", BY_RECORD)
)


def by_position(m: Motion, u: Units, *, moves: bool, linear: bool) -> Iterator[Law]:
    """Every law of the position that these motions can show."""
    span = float(np.ptp(m.theta))
    centre = 0.5 * float(m.theta.max() + m.theta.min())
    yield _spring(centre, u)
    yield from (_stiffening(centre, 0.5 * span, growth, u) for growth in GROWTHS)
    yield _any(centre, 0.5 * span, u)
    if not linear:
        yield from (_pendulum(u, turns) for turns in dict.fromkeys((1.0, m.turns)) if turns * span > LEAST_TURN)
    if not linear and span > LEAST_TRAVEL:
        yield _friction_by_angle(u)
    yield from _gear_lines(m, span, u)
    yield from _lines(span, u, linear=linear, but=m.gear_orders)
    if moves and not linear:
        yield from _flux_ripples(span, u)
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
    for width, flatness in product(STRETCHES, FORMS):
        for at in np.linspace(float(m.theta.min()), float(m.theta.max()), N_PLACES):
            yield _stretch(float(at), width * span, flatness, span / N_PLACES, u)


def _friction_by_angle(u: Units) -> Law:
    """What rubs once and twice per turn."""
    return Law(
        FRICTION.name,
        FRICTION.name,
        FRICTION.name,
        lambda m, _: tuple(m.direction * wave for n in ORDERS for wave in m.waves(n)),
        dict.fromkeys(PARTS, u.torque),
        _per_turn,
        f"friction changes with the angle: once ({{once_cosine:+.2g}}, {{once_sine:+.2g}} {u.torque}) and twice "
        f"({{twice_cosine:+.2g}}, {{twice_sine:+.2g}} {u.torque}) per turn",
        FRICTION.separated_by,
        is_friction=True,
        n_columns=len(PARTS),
    )


def _per_turn(c: Array) -> Mapping[str, float]:
    return dict(zip(PARTS, map(float, c), strict=True))


def _stretch(at: float, width: float, flatness: float, apart: float, u: Units) -> Law:
    """One of a family whose centres lie about `apart`, and whose widths about a factor of two."""

    def columns(m: Motion, _: Acting) -> tuple[Array, ...]:
        return (m.direction * np.exp(-fading((m.theta - at) / width, flatness)),)

    def finer(share: float) -> list[Law]:
        moved = [_stretch(at + side * share * apart, width, flatness, apart, u) for side in (-1.0, 1.0)]
        return [*moved, *(_stretch(at, width * 2.0**grown, flatness, apart, u) for grown in (-share, share))]

    return Law(
        "stretch of friction",
        f"stretch {at:.4g} {width:.4g} {flatness:g}",
        STRETCH.name,
        columns,
        {"more": u.torque, "centre": u.place, "width": u.place},
        one("more", centre=at, width=width, flatness=flatness),
        f"friction is {{more:+.3g}} {u.torque} other around {{centre:.3g}} {u.place} ± {{width:.2g}} {u.place}",
        "slow motion over the whole travel",
        is_friction=True,
        finer=finer,
    )


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


def _stiffening(centre: float, half: float, growth: float, u: Units) -> Law:
    """b + c_1 x + c_2 `bends` + c_3 `tilts`, of x = -1 … 1 over the travel"""

    def columns(m: Motion, _: Acting) -> tuple[Array, ...]:
        x = (m.theta - centre) / half
        return np.ones(len(x)), x, np.asarray(bends(x, growth)), np.asarray(tilts(x, growth))

    def values(c: Array) -> Mapping[str, float]:
        bias, middle, bent, tilted = (float(x) for x in c)
        torques = {"middle": middle, "lower": middle + bent - tilted, "upper": middle + bent + tilted}
        stiff = {name: torque / half for name, torque in torques.items()}
        return {**stiff, "bias": bias, "centre": centre, "half": half, "over": half / growth}

    stiffness = f"{u.torque}/{u.place}"
    return Law(
        STIFFENING,
        f"{STIFFENING} {growth:g}",
        EFFECT.name,
        columns,
        {"middle": stiffness, "lower": stiffness, "upper": stiffness, "bias": u.torque},
        values,
        in_metres(EFFECT.sentence) if u is LINEAR else EFFECT.sentence,
        EFFECT.separated_by,
        n_columns=4,
    )


def _any(centre: float, half: float, u: Units) -> Law:
    """Whatever a torque does along the travel, as Chebyshev's polynomials: it has no name."""

    def polynomials(n: int) -> Columns:
        return lambda m, _: tuple(chebvander((m.theta - centre) / half, n - 1).T)

    return Law(
        ANY,
        ANY,
        "position_torque",
        polynomials(N_POLYNOMIALS),
        {"size": u.torque},
        lambda c: {"size": float(np.linalg.norm(c[1:]))},
        f"a {u.said} that is a function of the position, {{size:.3g}} {u.torque}, of no form that has a name",
        "slow motion over the whole travel, and the same with what hangs or pulls at the axis taken off",
        n_columns=N_POLYNOMIALS,
        freer=polynomials(2 * N_POLYNOMIALS),
    )


def _line(order: float) -> Columns:
    return lambda m, _: m.waves(order)


def _of_line(order: float) -> Values:
    """Amplitude and phase:  c cos nθ + s sin nθ = A sin(nθ + φ)"""

    def values(c: Array) -> Mapping[str, float]:
        line = {"amplitude": float(np.hypot(*c)), "phase": float(np.arctan2(c[0], c[1]))}
        return {**line, "order": order} if order else line

    return values


def _pendulum(u: Units, turns: float) -> Law:
    """On the axis itself, or behind a gear."""
    behind = "" if turns == 1.0 else f" of the load, {1.0 / turns:.4g} of this side"
    return Law(
        "pendulum",
        "pendulum" if turns == 1.0 else f"pendulum {turns:.6g}",
        "pendulum",
        _line(turns),
        {"amplitude": u.torque, "phase": "rad", "turns": "1"},
        lambda c: {**_of_line(0.0)(c), "turns": turns},
        f"gravity on a pendulum or an unbalanced load, {{amplitude:.3g}} {u.torque} once per turn{behind}",
        "the same motion with the shaft upright",
        n_columns=2,
    )


def _gear_lines(m: Motion, span: float, u: Units) -> Iterator[Law]:
    """Lines at orders of the gear; one that the motion does not tell from a whole number may be the motor's, too."""
    for n in m.gear_orders:
        if n * span < 2.0 * np.pi:
            continue
        whole = round(n) >= 1 and abs(n - round(n)) * span < np.pi
        law = _torque_line(
            GEAR_LINE,
            f"gear line {n:.6g}",
            "gear_error",
            n,
            f"gear error: a {u.said} of {{amplitude:.3g}} {u.torque} with {{order:.5g}} periods per turn",
            "the motor alone, uncoupled from the gear; or the position at both sides of the gear",
            u,
        )
        yield replace(law, also=("cogging",)) if whole else law


def _lines(span: float, u: Units, *, linear: bool, but: tuple[float, ...]) -> Iterator[Law]:
    resolution = 2.0 * np.pi / span
    step = resolution if linear else 1.0  # a torque locked to a rotor closes after a turn
    lowest = FEWEST_PERIODS * resolution if linear else float(_lowest_order(span))
    for n in np.arange(lowest, min(HIGHEST_ORDER * step, lowest + step * N_ORDERS), step):
        if n in but:
            continue  # stands among the gear's
        yield _line_along(float(n), step, u) if linear else _line_of_a_turn(float(n), u)


def _flux_ripples(span: float, u: Units) -> Iterator[Law]:
    """A share of the motor's own torque, by lines."""
    for n in range(_lowest_order(span), HIGHEST_RIPPLE + 1):
        yield Law(
            "flux ripple",
            f"flux ripple {n}",
            FLUX_RIPPLE.name,
            _share_of_motor(n),
            {"amplitude": "1", "order": "1/turn", "phase": "rad"},
            _of_line(float(n)),
            f"{{amplitude:.2%}} of the drive's {u.said} come and go, with {{order:.4g}} periods per turn: a torque "
            "constant that ripples",
            FLUX_RIPPLE.separated_by,
            needs_acting=True,
            n_columns=2,
        )


def _share_of_motor(n: float) -> Columns:
    """τ cos nθ, τ sin nθ"""
    line = _line(n)
    return lambda m, acting: tuple(acting.motor * part for part in line(m, acting))


def _lowest_order(span: float) -> int:
    """Of a line that closes after a turn."""
    return int(max(2.0, np.ceil(FEWEST_PERIODS * 2.0 * np.pi / span - CLOSED)))


def _torque_line(family: str, key: str, name: str, n: float, sentence: str, separated_by: str, u: Units) -> Law:
    """A sin(nθ + φ)"""
    order = "rad/m" if u is LINEAR else "1/turn"
    parameters = {"amplitude": u.torque, "order": order, "phase": "rad"}
    return Law(family, key, name, _line(n), parameters, _of_line(n), sentence, separated_by, n_columns=2)


def _line_of_a_turn(n: float, u: Units) -> Law:
    return _torque_line(
        TORQUE_LINE,
        f"line {n:.5g}",
        "cogging",
        n,
        f"a {u.said} of {{amplitude:.3g}} {u.torque} with {{order:.4g}} periods per turn",
        "slow motion over a full turn, with the drive off",
        u,
    )


def _line_along(n: float, step: float, u: Units) -> Law:
    """No order is whole along a travel: lines stand for all that lie between them, `step` [rad/m] apart."""
    law = _torque_line(
        TRAVEL_LINE,
        f"line {n:.8g}",
        POSITION_LINE.name,
        n,
        in_metres(POSITION_LINE.sentence).replace("{period:.4g}", f"{2.0 * np.pi / n:.4g}"),
        POSITION_LINE.separated_by,
        u,
    )
    return replace(law, finer=lambda share: [_line_along(n + side * share * step, step, u) for side in (-1.0, 1.0)])
