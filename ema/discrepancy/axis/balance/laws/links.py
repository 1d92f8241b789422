"""Two links in a plane: what a neighbouring axis does to this one, by Lagrange's equations.

With the angle ψ of the neighbour, h = m_2 l_1 r_2, and the outer angle counted from the inner link:

    inner axis:  τ_1 = … + I_2 ψ'' + h [cos ψ (2 θ'' + ψ'') - sin ψ (2 θ' ψ' + ψ'²)] + G_1 sin(θ + φ_1) + G_2 sin(θ + ψ + φ_2)
    outer axis:  τ_2 = … + I_2 ψ'' + h [cos θ ψ'' + sin θ ψ'²]                       + G_2 sin(θ + ψ + φ_2)

References
----------
Siciliano et al., "Robotics: Modelling, Planning and Control", Springer 2009, section 7.3.2 (two-link planar arm).
"""  # noqa: E501

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ema.core.records import Array

from .law import Acting, Columns, Law
from .motion import Motion

LINKS = "links"
COUPLED = "coupled_friction"


def coupled_friction(unit: str) -> Iterator[Law]:
    """Friction on the sum or the difference of both speeds, where one motor's gear moves with both (a wrist)."""
    for side, said in ((1.0, "sum"), (-1.0, "difference")):
        yield Law(
            "coupled friction",
            f"friction on the {said} of speeds",
            COUPLED,
            _on_both(side),
            {"dry": unit, "viscous": f"{unit} s/rad"},
            lambda c: {"dry": float(c[0]), "viscous": float(c[1])},
            f"friction acts on the {said} of this axis' speed and its neighbour's, {{dry:.3g}} {unit} and "
            f"{{viscous:.3g}} {unit} s/rad",
            "each axis moved with the other locked",
            is_friction=True,
            n_columns=2,
        )


def _on_both(side: float) -> Columns:
    def columns(m: Motion, _: Acting) -> tuple[Array, ...]:
        both = m.w + side * m.other[1]
        return (np.sign(both), both)

    return columns


def links(m: Motion) -> Law:
    """The law of a neighbour that was recorded, on the side that the plant file declares."""
    inner = m.neighbour == "outer"  # this axis is the inner one where the neighbour is the outer
    gravity = {"gravity": "N m", "phase": "rad"} if inner else {}
    return Law(
        LINKS,
        LINKS,
        "linked_axis",
        _inner if inner else _outer,
        {"coupling": "kg m^2", "inertia": "kg m^2", **gravity, "gravity_outer": "N m", "phase_outer": "rad"},
        _values,
        "the neighbouring axis acts on this one: coupling {coupling:.3g} kg m² and inertia {inertia:.3g} kg m², "
        + ("gravity {gravity:.3g} N m and {gravity_outer:.3g} N m" if inner else "gravity {gravity_outer:.3g} N m"),
        "the same motion with the neighbour locked",
        n_columns=6 if inner else 4,
        weak=_inner_weak if inner else _outer_weak,
    )


def _inner(m: Motion, _: Acting) -> tuple[Array, ...]:
    psi, v, a = m.other
    h = np.cos(psi) * (2.0 * m.a + a) - np.sin(psi) * (2.0 * m.w * v + v**2)
    return (h, a, *_gravity(m), np.cos(m.theta), np.sin(m.theta))


def _outer(m: Motion, _: Acting) -> tuple[Array, ...]:
    v, a = m.other[1:]
    h = np.cos(m.theta) * a + np.sin(m.theta) * v**2
    return (h, a, *_gravity(m))


def _inner_weak(m: Motion) -> list[tuple[Array, Array]]:
    """h: d/dt [cos ψ (2 θ' + ψ')], the momentum that the links exchange."""
    psi, v = m.other[:2]
    none = np.zeros(len(m.t))
    momenta = (np.cos(psi) * (2.0 * m.w + v), v, none, none, none, none)
    return list(zip((none, none, *_gravity(m), np.cos(m.theta), np.sin(m.theta)), momenta, strict=True))


def _outer_weak(m: Motion) -> list[tuple[Array, Array]]:
    """h: d/dt [cos θ ψ'] + sin θ (θ' ψ' + ψ'²)"""
    v = m.other[1]
    none = np.zeros(len(m.t))
    momenta = (np.cos(m.theta) * v, v, none, none)
    return list(zip((np.sin(m.theta) * (m.w + v) * v, none, *_gravity(m)), momenta, strict=True))


def _gravity(m: Motion) -> tuple[Array, Array]:
    """Of the outer link."""
    both = m.theta + m.other[0]
    return np.cos(both), np.sin(both)


def _values(c: Array) -> Mapping[str, float]:
    out = {"coupling": float(c[0]), "inertia": float(c[1])}
    if len(c) > 4:
        out |= {"gravity": float(np.hypot(c[4], c[5])), "phase": float(np.arctan2(c[4], c[5]))}
    return out | {"gravity_outer": float(np.hypot(c[2], c[3])), "phase_outer": float(np.arctan2(c[2], c[3]))}
