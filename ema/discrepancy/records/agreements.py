"""Whether a record's channels agree: is the speed the derivative of the position, does current make torque?

Factors that are near a usual mistake of units are told with it. Each comparison is a line through two series without an
offset; the slope by the geometric mean of both regressions, so that noise of either side does not bend it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ema.core.names import CURRENTS
from ema.core.records import Array, Cycle, Record

AGREES = 0.7  # correlation from which two series are about the same thing
NEAR = 0.03  # relative; a slope within so much of a factor is that factor
OVER = 9  # samples over which a derivative is taken
# What a channel times such a factor would be, where somebody confused two units.
MISTAKES = (
    (2.0 * np.pi, "2π: turns taken for radians"),
    (1.0 / (2.0 * np.pi), "1/2π: radians taken for turns"),
    (60.0, "60: per minute taken for per second"),
    (1.0 / 60.0, "1/60: per second taken for per minute"),
    (30.0 / np.pi, "60/2π: rpm taken for rad/s"),
    (np.pi / 30.0, "2π/60: rad/s taken for rpm"),
    (180.0 / np.pi, "180/π: degrees taken for radians"),
    (np.pi / 180.0, "π/180: radians taken for degrees"),
    (1000.0, "1000: milli-units taken for units"),
    (1e-3, "1/1000: units taken for milli-units"),
)


@dataclass(frozen=True)
class Agreement:
    """One comparison.

    Attributes
    ----------
    what : str
        What is compared with what.
    slope : float
        The first over the second. [1, or as said]
    correlation : float
        Of both, -1 … 1.
    is_fine : bool
    said : str
        The answer in words.
    """

    what: str
    slope: float
    correlation: float
    is_fine: bool
    said: str


def agreements(record: Record) -> list[Agreement]:
    """Every comparison that the record's channels allow."""
    return list(_found(record))


def _found(record: Record) -> Iterator[Agreement]:
    have = {name for name in record.channels if any(np.ptp(cycle[name]) > 0.0 for cycle in record.cycles)}
    for position, speed in (("theta_m", "w_m"), ("q", "v")):
        if {position, speed} <= have:
            yield _same(f"{speed} against d{position}/dt", _speeds(record, position, speed))
    for speed, position in (("w_m", "theta_m"), ("v", "q")) if not record.is_at_rest else ():
        for drive in ("i_q", "torque", "force"):
            if drive in have and have & {speed, position}:
                name = speed if speed in have else position
                yield _pushes(record, drive, name, second=name == position)
    if {"theta_u", "theta_m"} <= have:
        yield _gear(record)
    if {"theta_u", "theta_cmd"} <= have:
        pairs = _pairs(record, lambda c: c["theta_u"], lambda c: c["theta_cmd"])
        yield _same("theta_u against theta_cmd", pairs, loose=True)
    if set(CURRENTS) <= have:
        yield _star(record)


def _pairs(record: Record, first: Callable[[Cycle], Array], second: Callable[[Cycle], Array]) -> tuple[Array, Array]:
    """Both series of all cycles one behind the other, each cycle without its mean."""
    x, y = [], []
    for cycle in record.cycles:
        if cycle.n_samples > 4 * OVER:
            a, b = first(cycle), second(cycle)
            inside = slice(OVER, -OVER)
            x.append(a[inside] - a[inside].mean())
            y.append(b[inside] - b[inside].mean())
    return (np.concatenate(x), np.concatenate(y)) if x else (np.zeros(1), np.zeros(1))


def _speeds(record: Record, position: str, speed: str) -> tuple[Array, Array]:
    """Told and derived speed; not less their means, since both have a true zero."""
    inside = slice(OVER, -OVER)
    cycles = [cycle for cycle in record.cycles if cycle.n_samples > 4 * OVER]
    told = [smooth(cycle[speed])[inside] for cycle in cycles]
    derived = [derivative(cycle, position)[inside] for cycle in cycles]
    return (np.concatenate(told), np.concatenate(derived)) if cycles else (np.zeros(1), np.zeros(1))


def _line(x: Array, y: Array) -> tuple[float, float]:
    """Slope of x over y, and correlation."""
    xx, yy, xy = float(x @ x), float(y @ y), float(x @ y)
    if xx == 0.0 or yy == 0.0:
        return np.nan, 0.0
    return float(np.sign(xy) * np.sqrt(xx / yy)), xy / np.sqrt(xx * yy)


def _same(what: str, pairs: tuple[Array, Array], *, loose: bool = False) -> Agreement:
    slope, r = _line(*pairs)
    near = (0.3 if loose else NEAR) + 1.0 - abs(r)  # what does not go together bends the slope by as much
    if abs(r) < AGREES:
        return Agreement(what, slope, r, False, "not the same thing: they hardly go together")
    if slope < 0.0:
        return Agreement(what, slope, r, False, f"of opposite sign (slope {slope:.4g}): one of them wants sign: -1")
    if abs(slope - 1.0) < near:
        return Agreement(what, slope, r, True, f"the same within {100 * abs(slope - 1.0):.1f} %")
    for factor, words in MISTAKES:
        if abs(slope / factor - 1.0) < near:
            return Agreement(what, slope, r, False, f"a factor {slope:.4g}, near {words}")
    return Agreement(what, slope, r, False, f"a factor {slope:.4g} between them")


def _pushes(record: Record, drive: str, name: str, *, second: bool) -> Agreement:
    """Whether the drive accelerates in the direction it points: friction and loads only weaken the correlation."""

    def acceleration(cycle: Cycle) -> Array:
        once = derivative(cycle, name)
        return derivative(cycle, once) if second else once

    slope, r = _line(*_pairs(record, lambda c: smooth(c[drive]), acceleration))
    what = f"{drive} against the acceleration by {name}"
    if abs(r) < 0.2:
        return Agreement(what, slope, r, True, "inertia is little of it: friction or a load takes most")
    if r < 0.0:
        said = "it brakes where it should push: a sign, or a load that turns with the motion (a spring, gravity)"
        return Agreement(what, slope, r, False, said)
    return Agreement(what, slope, r, True, "it pushes where it points")


def _gear(record: Record) -> Agreement:
    x, y = _pairs(record, lambda c: np.unwrap(c["theta_m"]), lambda c: c["theta_u"])
    slope, r = _line(x, y)
    what = "theta_m against theta_u"
    if abs(r) < AGREES:
        return Agreement(what, slope, r, False, "the user does not follow the motor: a gear cannot be told")
    sign = "" if slope > 0 else ", of opposite sign"
    return Agreement(what, slope, r, slope > 0, f"a gear ratio near {abs(slope):.4g}{sign}")


def _star(record: Record) -> Agreement:
    i = np.concatenate([np.stack([cycle[name] for name in CURRENTS]) for cycle in record.cycles], axis=1)
    size, rest = float(np.sqrt(np.mean(i**2))), float(np.sqrt(np.mean(i.sum(axis=0) ** 2)))
    ratio = rest / size if size else np.nan
    fine = ratio < 0.05
    said = f"they sum to zero within {100 * ratio:.1f} % of their rms" if fine else (
        f"their sum is {100 * ratio:.0f} % of their rms: a sensor's gain, offset or sign, or no floating neutral"
    )  # fmt: skip
    return Agreement("i_a + i_b + i_c", ratio, np.nan, fine, said)


def smooth(x: Array) -> Array:
    """The straight line through OVER samples, at their middle."""
    return np.convolve(x, np.full(OVER, 1.0 / OVER), mode="same")


def derivative(cycle: Cycle, of: str | Array) -> Array:
    """Slope of the straight line through OVER samples; angles are unwrapped."""
    x = cycle[of] if isinstance(of, str) else of
    if isinstance(of, str) and of == "theta_m":
        x = np.unwrap(x)
    k = np.arange(OVER) - OVER // 2
    per_sample = -k / float(k @ k)
    return np.convolve(x, per_sample, mode="same") / np.convolve(cycle["t"], per_sample, mode="same")
