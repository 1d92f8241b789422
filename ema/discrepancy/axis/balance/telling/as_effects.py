"""Laws of the balance as effects of the library, which the axis model simulates."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ema.core.records import Array
from ema.discrepancy.axis.balance.laws.law import Law
from ema.discrepancy.axis.balance.regressing.found import Balance, Term, draw_law
from ema.discrepancy.axis.naming.naming import line
from ema.discrepancy.plant import Point
from ema.effects.per_turn import PARTS
from ema.effects.stiffening_spring import EFFECT
from ema.models.axis_config import LINES

CLEAR = 3.0  # standard deviations by which the plant file is off
FITTED = {"inertia": {"J", "M"}, "viscous_drag": {"C"}}  # what a fit changes in the place of these effects
Effects = dict[str, dict[str, float]]
Values = Mapping[str, float]


def effects(b: Balance, term: Term) -> Effects:
    """Effects with their parameters; empty where the library has none that acts like this law."""
    return _of_law(b, term.law, b.corrected.coefficients[b.model.part(term.law)])


def of_base(b: Balance) -> Effects:
    """Inertia and drag that are clearly others than the plant file's, as effects beside it."""
    sd = dict(zip(b.model.base, np.sqrt(np.diag(b.corrected.covariance)), strict=False))
    clear = {name: x for name, x in beyond_file(b).items() if name in sd and abs(x) > CLEAR * sd[name]}
    out: Effects = {}
    if "viscous_drag" in clear:
        out["viscous_drag"] = {"coefficient": clear["viscous_drag"]}
    if "inertia" in clear and b.plain.inertia > 0.0:
        out["inertia"] = {"change": clear["inertia"] / b.plain.inertia}
    return out


def beyond_file(b: Balance) -> dict[str, float]:
    """Inertia and drag as fitted, less the plant file's."""
    fitted = dict(zip(b.model.base, b.corrected.coefficients, strict=False))
    return {
        "inertia": float(fitted.get("inertia", b.plain.inertia)) - b.plain.inertia,
        "viscous_drag": float(fitted.get("viscous_drag", 0.0)),  # that is fitted so
    }


def errors(b: Balance, term: Term) -> Effects:
    """Standard deviations of the parameters that `effects` gives."""
    samples = draw_effects(b, term)
    return {
        name: {p: float(np.std([own[name][p] for own in samples if name in own])) for p in values}
        for name, values in effects(b, term).items()
    }


def draw_effects(b: Balance, term: Term) -> list[Effects]:
    """What `effects` gives, over draws of the law and its coefficients."""
    return [_of_law(b, law, c) for law, c in draw_law(b, term)]


def find_alternatives(b: Balance, term: Term) -> Effects:
    """The same of the laws that the balance cannot tell from this one."""
    found: Effects = {}
    for other in term.instead:
        law = other.laws[-1]
        found |= _of_law(b, law, other.coefficients[other.part(law)])
    return found


def _of_law(b: Balance, law: Law, own: Array) -> Effects:
    maker, F_d = _MAKERS.get(law.name), friction(b)
    if maker is None or (F_d <= 0.0 and maker.is_relative):
        return {}
    return maker.make(law.values(own), F_d, b.plain.k_t)


def friction(b: Balance) -> float:
    """Dry friction as fitted, or the plant file's where that is no friction: what relative laws refer to."""
    if "dry_friction" not in b.model.base:
        return b.plain.F_d
    value = b.plain.F_d + float(b.corrected.coefficients[b.model.base.index("dry_friction")])
    return value if value > 0.0 else b.plain.F_d


def line_point(name: str, values: Values) -> dict[str, float]:
    """Cosine and sine part of a line:  A sin(nθ + φ) = c cos nθ + s sin nθ"""
    A, phase = values["amplitude"], values["phase"]
    parts = {"cos": A * float(np.sin(phase)), "sin": A * float(np.cos(phase))}
    return {line(values["order"], part, name): value for part, value in parts.items()}


def point(b: Balance, *, linear: bool) -> Point:
    """Everything that was fitted, as the axis model takes it; laws that it has not are left out."""
    fitted = dict(zip(b.model.base, b.corrected.coefficients, strict=False))
    out = {"F_d": max(b.plain.F_d + float(fitted.get("dry_friction", 0.0)), 0.0)}
    out["C"] = b.plain.C + float(fitted.get("viscous_drag", 0.0))
    out["M" if linear else "J"] = max(float(fitted.get("inertia", b.plain.inertia)), 0.05 * b.plain.inertia)
    for term in b.terms:
        for name, values in effects(b, term).items():
            if name in LINES:
                out |= line_point(name, values)
                continue
            for parameter, value in values.items():
                key = f"{name}.{parameter}"
                out[key] = out.get(key, 0.0) + value if name == "constant_load" else value
    return out


@dataclass(frozen=True)
class _Maker:
    """What makes an effect of a law's values, dry friction and torque per ampere; `is_relative`: over dry friction."""

    make: Callable[[Values, float, float], Effects]
    is_relative: bool = False


def _as_it_is(name: str, *parameters: str) -> _Maker:
    return _Maker(lambda v, _, __: {name: {p: v[p] for p in parameters}})


def _friction_by_angle(v: Values, F_d: float, k_t: float) -> Effects:
    return {"friction_by_angle": {part: v[part] / F_d for part in PARTS}}


def _of_friction(name: str, parameter: str, of: str, *beside: str) -> _Maker:
    """`parameter` is the law's value `of` over dry friction; what is `beside` is as it is."""
    return _Maker(lambda v, F_d, _: {name: {parameter: v[of] / F_d, **{p: v[p] for p in beside}}}, is_relative=True)


def _friction_drift(v: Values, F_d: float, k_t: float) -> Effects:
    return {"friction_drift": {"rate": v["change"] / v["span"] / F_d, "since": v["begin"]}}


def _viscous_drift(v: Values, F_d: float, k_t: float) -> Effects:
    return {"viscous_drift": {"rate": v["change"] / v["span"], "since": v["begin"]}}


def _friction_by_temperature(v: Values, F_d: float, k_t: float) -> Effects:
    return {"friction_by_temperature": {"per_kelvin": v["per_kelvin"] * v["at_20_celsius"] / F_d}}


def _viscous_by_temperature(v: Values, F_d: float, k_t: float) -> Effects:
    """C (exp(-k ΔT) - 1) of a negative C rises with temperature, as that of -C and -k does."""
    k, C = v["per_kelvin"], v["at_20_celsius"]
    return {"viscous_by_temperature": {"per_kelvin": k if C > 0.0 else -k, "coefficient": abs(C)}}


def _spring(v: Values, F_d: float, k_t: float) -> Effects:
    k = v["stiffness"]
    return {"spring_load": {"stiffness": k}, "constant_load": {"torque": -k * v["zero"]}}


def _drive_unequal(v: Values, F_d: float, k_t: float) -> Effects:
    """Lost one way and gained the other: what both lose is a scale of the drive, unknown here."""
    c = v["share"] * k_t
    return {"drive_unequal": {"positive": c, "negative": -c}}


def _flux_ripple(v: Values, F_d: float, k_t: float) -> Effects:
    return {"flux_ripple": {**v, "amplitude": v["amplitude"] * k_t}}


_MAKERS: Mapping[str, _Maker] = {
    "viscous_by_direction": _as_it_is("viscous_by_direction", "difference"),
    "pendulum": _as_it_is("pendulum", "amplitude", "phase", "turns"),
    "output_load_friction": _as_it_is("output_load_friction", "share", "of_inertia"),
    "quadratic_output_load_friction": _as_it_is("quadratic_output_load_friction", "per_torque"),
    "quadratic_load_friction": _of_friction("quadratic_load_friction", "per_square", "per_torque"),
    "friction_memory": _as_it_is("friction_memory", "deflection"),
    "magnet_flux": _as_it_is("magnet_flux", "per_kelvin"),
    "friction_drift": _Maker(_friction_drift, is_relative=True),
    "viscous_drift": _Maker(_viscous_drift),
    "friction_by_temperature": _Maker(_friction_by_temperature, is_relative=True),
    "viscous_by_temperature": _Maker(_viscous_by_temperature),
    "viscous_slope": _as_it_is("viscous_slope", "slope", "centre"),
    "quadratic_drag": _as_it_is("quadratic_drag", "coefficient"),
    "constant_load": _as_it_is("constant_load", "torque"),
    "cogging": _as_it_is("cogging", "amplitude", "order", "phase"),
    "position_line": _as_it_is("position_line", "amplitude", "order", "phase"),
    "gear_error": _as_it_is("gear_error", "amplitude", "order", "phase"),
    "friction_by_angle": _Maker(_friction_by_angle, is_relative=True),
    "load_friction": _of_friction("load_friction", "per_torque", "share"),
    "friction_slope": _of_friction("friction_slope", "slope", "slope", "centre"),
    "stribeck": _of_friction("stribeck", "excess", "more", "speed", "shape"),
    "position_friction": _of_friction("position_friction", "height", "more", "centre", "width", "flatness"),
    "spring_load": _Maker(_spring),
    "stiffening_spring": _as_it_is("stiffening_spring", *(p.name for p in EFFECT.parameters)),
    "drive_unequal": _Maker(_drive_unequal),
    "flux_ripple": _Maker(_flux_ripple),
}
