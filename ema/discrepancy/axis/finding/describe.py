"""Found effects in an engineer's words and numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ema.discrepancy.axis.naming.interval import interval
from ema.discrepancy.axis.naming.linear import by_drive, of_axis, units_of
from ema.discrepancy.axis.naming.naming import numbers_of
from ema.discrepancy.axis.scanning.cogging import MIN_LINE
from ema.discrepancy.plant import Candidate, Point
from ema.effects import registry

if TYPE_CHECKING:
    from ema.discrepancy.axis.reading.measured import Measured


def effects(plant: Measured, found: Sequence[Candidate], point: Point, drawn: Sequence[Point]) -> list[dict[str, Any]]:
    """One entry per effect (one per cogging line): name, sentence, parameters with intervals."""
    own = numbers_of(point)
    samples = [numbers_of(p) for p in drawn]
    out = []
    for candidate in found:
        if candidate.is_structure:
            continue
        effect = registry()[candidate.effect]
        names = {f.name for f in candidate.free}
        mine = numbers_of({name: value for name, value in point.items() if name in names})
        strongest = max((v.get("amplitude", 0.0) for v in own.effects.values()), default=0.0)
        for part in mine.effects.values():
            key, values = _whole(own.effects, part)
            if effect.name == "cogging" and values["amplitude"] < MIN_LINE * strongest:
                continue
            said = _said(plant)
            unit = units_of(effect, said)
            same = [there for s in samples if (there := own.like(key, s)) is not None]
            parameters = {}
            for name, value in values.items():
                spread = [there[name] for there in same if name in there]  # an effect may be there of another kind
                low, high = interval(name, value, spread or [value])
                parameters[name] = {"value": value, "low": low, "high": high, "unit": unit[name]}
            entry = {
                "key": candidate.key,
                "name": effect.name,
                "sentence": said(effect.said(values, own.parameters.get("F_d", plant.plant.F_d))),
                "separated_by": said(effect.separated_by),
                "parameters": parameters,
            }
            out.append(entry | (_line(plant, values) if effect.name == "cogging" else {}))
    return out


def _said(plant: Measured) -> Callable[[str], str]:
    """How sentences and units are said of this axis and its drive."""
    linear = plant.plant.is_linear
    return lambda text: of_axis(by_drive(text, plant.plant.drive), linear=linear)


def _line(plant: Measured, values: dict[str, float]) -> dict[str, Any]:
    """What else makes a torque line of this order."""
    return _unbalance(values) if round(values["order"]) == 1 else _electrical(plant, values)


def _unbalance(values: dict[str, float]) -> dict[str, Any]:
    """Once per turn no motor cogs that is whole: what hangs on the shaft has weight, or the rotor runs out."""
    return {
        "also": ["unbalance"],
        "n_equal": 1,
        "sentence": f"torque of {values['amplitude']:.3g} N m once per turn: the weight of an unbalanced load, "
        "or a rotor that is off centre",
        "separated_by": "the same motion with the shaft upright, or with the load taken off",
    }


def _electrical(plant: Measured, values: dict[str, float]) -> dict[str, Any]:
    """What else makes a line of this order where it is a whole number of periods per electrical turn.

    With the current given as i_q, an offset of a phase's sensor is a torque at the electrical frequency, and unequal
    sensor gains are one at twice that, proportional to the current.
    """
    p = getattr(plant.plant, "p", None)
    if p is None or plant.plant.is_force:
        return {}
    other = {p: "current_offset", 2 * p: "current_gain"}.get(round(values["order"]))
    if other is None:
        return {}
    slots = getattr(plant.plant, "slots", None)
    odd = slots is not None and values["order"] % slots and values["order"] % (2 * p)
    say = f"; a sound motor cogs at multiples of {slots} slots or {2 * p} poles only" if odd else ""
    what = {"current_offset": "an offset of a phase's current sensor", "current_gain": "unequal phase current sensors"}
    periods = {"current_offset": "once", "current_gain": "twice"}[other]
    return {
        "also": [other],
        "n_equal": 1,
        "sentence": f"torque of {values['amplitude']:.3g} N m with {values['order']:.4g} periods per rotor turn, "
        f"{periods} per electrical turn: cogging or {what[other]}{say}",
        "separated_by": "the three phase currents, with the inverter off and under load",
    }


def _whole(effects_: dict[str, dict[str, float]], part: dict[str, float]) -> tuple[str, dict[str, float]]:
    """The effect that `part` is of, with what of it was held: of friction by temperature, the friction itself."""
    return next((key, values) for key, values in effects_.items() if part.items() <= values.items())


def structure(plant: Measured, terms: Sequence[Candidate], point: Point) -> dict[str, Any]:
    """What the unnamed terms look like."""
    out: dict[str, Any] = {"terms": [], "orders": [], "frequencies": [], "depends_on": []}
    unit = "N" if plant.plant.is_linear else "N m"
    for candidate in terms:
        key = candidate.free[0].name.split(".")[0]
        values = {name.removeprefix(f"{key}."): v for name, v in point.items() if name.startswith(f"{key}.")}
        sentence, depends = _sentence(candidate.effect, values, unit)
        out["terms"].append({"family": candidate.effect, "sentence": sentence, "values": values})
        out["depends_on"] += [d for d in depends if d not in out["depends_on"]]
        if values["order"]:
            out["orders"].append(values["order"])
        if values["frequency"]:
            out["frequencies"].append(values["frequency"])
    return out


def _sentence(family: str, v: dict[str, float], unit: str) -> tuple[str, list[str]]:
    size = abs(v["coefficient"])
    what = "friction" if v["is_friction"] else "torque" if unit == "N m" else "force"
    if v["order"]:
        times = " per ampere" if v["current_power"] else ""
        is_whole = abs(v["order"] - round(v["order"])) < 0.02
        nature = "" if is_whole else ", no whole number: no part of the motor itself"
        if is_whole and times and not v["is_friction"]:
            nature = ", as a torque constant does that ripples with the angle (harmonics of the magnets' flux)"
        where = f"with {v['order']:.4g} periods per turn{nature}"
        if unit == "N":
            where = f"over the travel, once in {2.0 * np.pi / v['order']:.3g} m"
        return (
            f"{what} varies by {size:.3g} {unit}{times} {where}",
            ["angle", *(["current"] if v["current_power"] else [])],
        )
    if v["frequency"]:
        return (
            f"{what} of {size:.3g} {unit} swings with {v['frequency']:.4g} Hz in time, whatever the motion: of the "
            "supply, the bench or a neighbour",
            ["time"],
        )
    if v["angle_width"]:
        return (
            f"{what} changes by {v['coefficient']:+.3g} {unit} around position {v['angle_centre']:.4g}, "
            f"half width {v['angle_width']:.2g}",
            ["angle", *(["sign of speed"] if v["is_friction"] else [])],
        )
    if v["time_width"]:
        return (
            f"{what} changes by {v['coefficient']:+.3g} {unit} around t = {v['time_centre']:.4g} s of a cycle, "
            f"half width {v['time_width']:.2g} s: intermittent",
            ["time", *(["sign of speed"] if v["is_friction"] else [])],
        )
    depends = [name for name, power in (("speed", v["speed_power"]), ("current", v["current_power"])) if power]
    return f"a {what} {family}, coefficient {v['coefficient']:.3g}", depends
