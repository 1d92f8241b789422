"""The law of friction with memory: after a reversal it builds up over some way, at whatever speed."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ema.core.records import Array
from ema.effects.friction_memory import built_up

from .law import Among, Columns, Law, one
from .motion import Motion

SHORTEST, LONGEST, N_WAYS = 0.004, 0.5, 12  # of the way between two reversals; members of the family between these
GAP = 5.0  # median samples without a reading after which nothing is known of the bristles


def memory_laws(m: Motion, torque: str, place: str) -> Iterator[Law]:
    """A family over the way that friction needs; none where the axis does not turn round."""
    new = np.diff(m.t, prepend=m.t[0] - 1.0)
    begins = (new <= 0.0) | (new > GAP * float(np.median(new))) | m.static
    stroke = _stroke(m, begins)
    ends = SHORTEST * stroke, LONGEST * stroke
    for way in np.geomspace(*ends, N_WAYS) if stroke > 0.0 else ():
        yield _memory(begins, float(way), ends, torque, place)


def _memory(begins: NDArray[np.bool_], way: float, ends: tuple[float, float], torque: str, place: str) -> Law:
    """Friction that builds up over a `way` between `ends`."""
    step = math.log(LONGEST / SHORTEST) / (N_WAYS - 1)
    return Law(
        "friction with memory",
        f"memory {way:.8g}",
        "friction_memory",
        _not_yet(begins, way),
        {"torque": torque, "deflection": place},
        one("torque", deflection=way),
        f"friction has a memory: after a reversal {{torque:.3g}} {torque} of it build up over "
        f"{{deflection:.3g}} {place} (presliding)",
        "small reversing motions of several amplitudes at several frequencies",
        is_friction=True,
        among=Among(
            np.array([math.log(way) / step]),
            np.log([ends]) / step,
            lambda at: _memory(begins, math.exp(at[0] * step), ends, torque, place),
        ),
    )


def _stroke(m: Motion, begins: NDArray[np.bool_]) -> float:
    """Median way between reversals; 0 where there are none. [rad or m]"""
    moves = np.flatnonzero(m.direction != 0.0)
    turns = np.flatnonzero(np.diff(m.direction[moves]) != 0.0)
    places = m.theta[moves[turns]]
    same = np.diff(np.cumsum(begins)[moves[turns]]) == 0 if len(turns) > 1 else np.zeros(0, bool)
    ways = np.abs(np.diff(places))[same] if len(turns) > 1 else np.zeros(0)
    return float(np.median(ways)) if ways.size else 0.0


def _not_yet(begins: NDArray[np.bool_], way: float) -> Columns:
    """s - sign ω: what dry friction has not built up."""

    def columns(m: Motion, _: object) -> tuple[Array, ...]:
        return (np.where(m.direction == 0.0, 0.0, _share(m.theta, m.direction, begins, way) - m.direction),)

    return columns


@njit(cache=True)
def _share(theta: Array, direction: Array, begins: NDArray[np.bool_], way: float) -> Array:
    """Share of friction that is built up at every sample."""
    out = np.empty(len(theta))
    s = 0.0
    for k in range(len(theta)):
        if begins[k]:
            s = direction[k]
        elif direction[k] != 0.0:  # where it may rest, noise is no way
            s = built_up(s, theta[k] - theta[k - 1], way)
        out[k] = s
    return out
