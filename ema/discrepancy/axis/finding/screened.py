"""Effects that are tried where the balance of torque shows their law, begun where the regression found them.

What no axis without them shows needs no place in the search of every record: each candidate more is one more that
noise may favour. A law that the balance cannot tell from the one it found is tried too: free runs may tell them, or
have both in a set with what the balance does not see.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ema.discrepancy.axis.balance.regressing.found import Balance
from ema.discrepancy.axis.balance.telling.as_effects import (
    FITTED,
    effects,
    errors,
    find_alternatives,
    line_point,
    of_base,
)
from ema.discrepancy.axis.naming.naming import line
from ema.discrepancy.plant import Candidate, Free, Point
from ema.effects import registry
from ema.effects.position_line import EFFECT as POSITION_LINE
from ema.models.axis_config import LINES, Axis

from .candidates import PRIOR, SHAPES

SCREENED = (
    *("viscous_by_direction", "pendulum", "output_load_friction", "drive_unequal", "viscous_slope", "friction_slope"),
    *(
        "stiffening_spring",
        "flux_ripple",
        "gear_error",
        "position_line",
        "quadratic_load_friction",
        "quadratic_output_load_friction",
    ),
    *("friction_drift", "viscous_drift", "friction_by_temperature", "viscous_by_temperature"),
)
ROOM = 10.0  # times the size that the regression found, to which a fit may go
FIXED = (  # parameters that the records of one bench hardly show
    *("turns", "order", "centre", "half", "over", "since", "damping", "shape"),
)
VAGUE = ("viscous_by_temperature.coefficient",)  # shown where records are warm enough to bend the law: else a prior


def suggest_by_balance(balance: Balance | None, plant: Axis, point: Point) -> list[Candidate]:
    """Candidates for the laws that the balance needs."""
    if balance is None:
        return []
    have = {name.split(".")[0] for name in point} | set(plant.effects)
    out = []
    for term in balance.terms:
        unsure = errors(balance, term)
        for name, values in (find_alternatives(balance, term) | effects(balance, term)).items():
            if name not in SCREENED:
                continue
            law = begin_at(name, values, unsure.get(name, {}), balance.travel)
            if not ({f.name for f in law.free} & point.keys() if name in LINES else name in have):
                out.append(law)
    return out


def begin_with_what_shows(
    balance: Balance | None, delays: Mapping[str, float], plant: Axis, library: Mapping[str, Candidate]
) -> list[Candidate]:
    """Delays that the channels show, and every law that the balance needs, begun there.

    With the library's own freedom where it has that effect. First delays, then an inertia and a drag that are not the
    plant file's, where that has them as known; but no lines of torque, of which a search finds each in what the others
    leave.
    """
    if balance is None:
        return []
    shown = {name: {"time": late} for name, late in delays.items()}
    shown |= {name: values for name, values in of_base(balance).items() if not FITTED[name] & set(plant.fitted)}
    out = {
        name: _start(library[name], {f"{name}.{p}": value for p, value in values.items()})
        for name, values in shown.items()
        if name in library
    }
    for term in balance.terms:
        unsure = errors(balance, term)
        for name, values in effects(balance, term).items():
            if name in LINES:
                continue
            law = begin_at(name, values, unsure.get(name, {}), balance.travel)
            own = library.get(law.key)
            if own is not None:
                law = _start(own, {f"{name}.{p}": value for p, value in values.items()})
            out.setdefault(law.key, law)
    return [*out.values()]


def _start(own: Candidate, known: Mapping[str, float]) -> Candidate:
    """The library's candidate, begun where values are known."""
    return replace(own, starts=({f.name: min(max(known.get(f.name, f.start), f.low), f.high) for f in own.free},))


def begin_at(name: str, values: dict[str, float], unsure: dict[str, float], travel: float) -> Candidate:
    """An effect that is fitted from where the balance has it, with the room of its values and of their errors."""
    return _line(name, values, travel) if name in LINES else _candidate(name, values, unsure)


def _line(name: str, values: dict[str, float], travel: float) -> Candidate:
    """Of a turn the order is whole, or the gear's; along a `travel` it is fitted, up to a period more or less."""
    start, A, order = line_point(name, values), values["amplitude"], values["order"]
    free = [Free(key, "N m", -ROOM * A, ROOM * A, value, 0.1 * A, 1e-3 * A) for key, value in start.items()]
    if name == POSITION_LINE.name:
        period = 2.0 * np.pi / travel
        key = line(order, "order", name)
        free.append(Free(key, "rad/m", order - period, order + period, order, 0.1 * period, 1e-3 * period))
        start = {**start, key: order}
    return Candidate(f"{name}:{order:.5g}", name, tuple(free), (start,))


def _candidate(name: str, values: dict[str, float], unsure: dict[str, float]) -> Candidate:
    effect = registry()[name]
    free = []
    for p in effect.parameters:
        if p.name in FIXED:
            continue
        value = values.get(p.name, p.neutral)
        if p.name in SHAPES:
            free.append(Free(f"{name}.{p.name}", p.unit, p.low, p.high, value, 0.2 * (p.high - p.low), is_shape=True))
        elif p.name == "phase":
            free.append(Free(f"{name}.{p.name}", p.unit, value - np.pi, value + np.pi, value, 0.1))
        else:
            size = max(abs(value), unsure.get(p.name, 0.0))
            if size == 0.0:
                continue  # nothing says how far it may go
            low = 0.0 if p.low == 0.0 else -ROOM * size
            key = f"{name}.{p.name}"
            prior = PRIOR * size if key in VAGUE else None
            free.append(Free(key, p.unit, low, ROOM * size, value, 0.1 * size, prior=prior))
    start = {f.name: f.start for f in free} | {f"{name}.{key}": value for key, value in values.items()}
    return Candidate(name, name, tuple(free), (start,))
