"""How late the recorded speed is behind the recorded position, or that behind the speed, by these two alone.

    ω(t) = dθ/dt (t - d)

holds whatever drives the axis (equation error), so no free run is asked: beside an inertia that is off it cannot say.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from ema.core.records import Array, Cycle

from .local_polynomials import smooth

OVER = 9  # samples in a local parabola
N_TURNS = 6  # of Gauss-Newton
MOST = 40.0  # samples that a delay may be
CLEAR = 3.0  # standard deviations

WHOLE = np.empty(0, dtype=np.int_)  # no gaps


def see_delays(cycles: Iterable[Cycle], position: str, speed: str) -> dict[str, float]:
    """The delay that is clear, by the name of its effect; none where neither channel is late. [s]"""
    courses = [_course(cycle, position, speed) for cycle in cycles if cycle.n_samples > 4 * (OVER + MOST)]
    if not courses:
        return {}
    dt = float(np.median(np.concatenate([np.diff(t) for t, *_ in courses])))
    late, sd = 0.0, np.inf
    for _ in range(N_TURNS):
        left, slope = (np.concatenate(x) for x in zip(*_shifted(courses, late, dt), strict=True))
        power = float(slope @ slope)
        if power == 0.0:
            return {}
        step = -float(slope @ left) / power
        sd = float(np.sqrt(OVER * np.mean((left + step * slope) ** 2) / power))  # a parabola's samples go together
        late = float(np.clip(late + step, -MOST * dt, MOST * dt))
    if abs(late) < CLEAR * sd or abs(late) < 0.5 * dt:
        return {}
    return {"speed_delay": late} if late > 0.0 else {"position_delay": -late}


def _course(cycle: Cycle, position: str, speed: str) -> tuple[Array, Array, Array]:
    """Time, slope of the position and speed, smoothed alike."""
    t, dt = cycle["t"], float(np.median(np.diff(cycle["t"])))
    theta = np.unwrap(cycle[position]) if position == "theta_m" else cycle[position]
    return t, smooth(theta, WHOLE, OVER, dt), smooth(cycle[speed], WHOLE, OVER)


def _shifted(courses: Iterable[tuple[Array, Array, Array]], late: float, dt: float) -> Iterator[tuple[Array, Array]]:
    """What the speed is beyond the slope of the position `late` before, and how that slope changes then."""
    edge = OVER + int(np.ceil(MOST))
    for t, slope, w in courses:
        then = t[edge:-edge] - late
        yield w[edge:-edge] - np.interp(then, t, slope), np.interp(then, t, np.gradient(slope, t))
