"""Two links in a plane: what a neighbouring axis does to this one, by Lagrange's equations.

With the angle ψ of the neighbour, h = m_2 l_1 r_2, and the outer angle counted from the inner link:

    inner axis:  τ_1 = … + I_2 ψ'' + h [cos ψ (2 θ'' + ψ'') - sin ψ (2 θ' ψ' + ψ'²)] + G_1 sin(θ + φ_1) + G_2 sin(θ + ψ + φ_2)
    outer axis:  τ_2 = … + I_2 ψ'' + h [cos θ ψ'' + sin θ ψ'²]                       + G_2 sin(θ + ψ + φ_2)

References
----------
Siciliano et al., "Robotics: Modelling, Planning and Control", Springer 2009, section 7.3.2 (two-link planar arm).
"""  # noqa: E501

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ema.core.records import Array

from .law import Acting, Law
from .rows import Motion


def links(m: Motion) -> Law:
    """The law of a neighbour that was recorded, on the side that the plant file declares."""
    inner = m.neighbour == "outer"  # this axis is the inner one where the neighbour is the outer
    gravity = {"gravity": "N m", "phase": "rad"} if inner else {}
    return Law(
        "links",
        "links",
        "linked_axis",
        _inner if inner else _outer,
        {"coupling": "kg m^2", "inertia": "kg m^2", **gravity, "gravity_outer": "N m", "phase_outer": "rad"},
        _values,
        "the neighbouring axis acts on this one: coupling {coupling:.3g} kg m² and inertia {inertia:.3g} kg m², "
        + ("gravity {gravity:.3g} N m and {gravity_outer:.3g} N m" if inner else "gravity {gravity_outer:.3g} N m"),
        "the same motion with the neighbour locked",
        n_columns=6 if inner else 4,
    )


def _inner(m: Motion, _: Acting) -> tuple[Array, ...]:
    psi, v, a = m.other
    h = np.cos(psi) * (2.0 * m.a + a) - np.sin(psi) * (2.0 * m.w * v + v**2)
    return (h, a, np.cos(m.theta + psi), np.sin(m.theta + psi), np.cos(m.theta), np.sin(m.theta))


def _outer(m: Motion, _: Acting) -> tuple[Array, ...]:
    psi, v, a = m.other
    h = np.cos(m.theta) * a + np.sin(m.theta) * v**2
    return (h, a, np.cos(m.theta + psi), np.sin(m.theta + psi))


def _values(c: Array) -> Mapping[str, float]:
    out = {"coupling": float(c[0]), "inertia": float(c[1])}
    if len(c) > 4:
        out |= {"gravity": float(np.hypot(c[4], c[5])), "phase": float(np.arctan2(c[4], c[5]))}
    return out | {"gravity_outer": float(np.hypot(c[2], c[3])), "phase_outer": float(np.arctan2(c[2], c[3]))}
