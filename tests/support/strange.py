"""A motor under cascaded loops with something in it that the library has not, or has in another form.

Shares no code with the models. Fine steps of a semi-implicit Euler rule; dry friction by its smallest torque that stops
the axis within a step. The controller acts on the sampled angle and holds the current it asks for until the next
sample. Each kind draws its size so that it takes a share of the torque that a test engineer would ask about.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from ema.core.records import Cycle, Record

FINE, HZ = 50, 1000
KINDS = (
    *("nothing", "cushion", "gap", "maxwell_slip", "current_ripple", "friction_twice", "crank", "heat", "clutch"),
    *("current_lag", "one_way_fan", "gusts", "load_step", "dwell", "centrifugal", "shaken"),
)
(NOTHING, CUSHION, GAP, SLIP, RIPPLE, TWICE, CRANK, HEAT, CLUTCH, LAG, FAN, GUSTS, STEP, DWELL, BRAKE, SHAKEN) = range(
    len(KINDS)
)


SINES = ((8.0, 0.25), (2.0, 0.9), (0.4, 2.7))  # of the reference: [rad], [Hz]


@dataclass(frozen=True)
class Axis:
    """Numbers of the axis at the motor's shaft."""

    J: float = 6e-5
    F: float = 0.025
    C: float = 1.5e-4
    k_t: float = 0.05
    noise: tuple[float, float, float] = (2e-4, 0.05, 4e-3)  # position, speed, current


def sizes(kind: int, axis: Axis, rng: np.random.Generator) -> tuple[float, float, float]:
    """Three numbers of a kind, as `_run` reads them."""
    F = axis.F
    later = rng.spawn(1)[0]  # a kind that came later leaves what is drawn for the others as it was
    return {
        NOTHING: (0.0, 0.0, 0.0),
        CUSHION: (rng.uniform(5.0, 6.5), rng.uniform(0.2, 0.5) * F, rng.uniform(0.05, 0.2) * F),  # from, linear, square
        GAP: (rng.uniform(0.03, 0.1), rng.uniform(0.3, 0.6), 400.0 * F),  # half width, share of J, stiffness
        SLIP: (rng.uniform(0.03, 0.1), 0.0, 0.0),  # of the first element
        RIPPLE: (rng.uniform(0.08, 0.2), float(rng.choice([6, 12, 18])), rng.uniform(0.0, 6.0)),
        TWICE: (rng.uniform(0.3, 0.6), 2.0, rng.uniform(0.0, 6.0)),
        CRANK: (rng.uniform(0.3, 0.5), 2.0, rng.uniform(0.0, 6.0)),
        HEAT: (rng.uniform(0.3, 0.6), rng.uniform(20.0, 60.0) * F, 0.0),  # share lost, over this work [J]
        CLUTCH: (rng.uniform(4e-4, 2e-3) * axis.J / 6e-5, rng.uniform(0.4, 0.7), 0.0),  # damping, share of J
        LAG: (rng.uniform(4e-3, 9e-3), 0.0, 0.0),  # [s]
        FAN: (rng.uniform(0.4, 0.9) * F / 20.0**2, 0.0, 0.0),
        GUSTS: (rng.uniform(0.2, 0.4) * F, 0.05, 0.0),  # rms, correlation time [s]
        STEP: (rng.uniform(0.2, 0.5) * F, rng.uniform(0.35, 0.65), 0.0),  # torque, when [of the record]
        DWELL: (rng.uniform(0.5, 1.5), rng.uniform(0.02, 0.1), 0.0),  # share that rest adds, over this time [s]
        BRAKE: (rng.uniform(0.1, 0.3) * F, rng.uniform(8.0, 14.0), 0.0),  # torque per speed beyond this one [rad/s]
        SHAKEN: (
            later.uniform(0.2, 0.5) * F,
            later.uniform(12.0, 40.0),
            later.uniform(0.0, 6.0),
        ),  # torque, [Hz], phase
    }[kind]


@njit(cache=True)
def _run(reference, kind, axis, q, gusts, loop, out):
    J, F, C, k_t = axis
    a, b, c = q
    theta, w, i_true = reference[0], 0.0, 0.0
    theta_l, w_l, work, rested = theta, 0.0, 0.0, 0.0
    z = np.zeros(3)
    own = 1.0 - b if kind in (GAP, CLUTCH) else 1.0  # share of the inertia that is the motor's
    dt = 1.0 / (HZ * FINE)
    n = len(reference)
    for k in range(n):
        ahead = (reference[min(k + 1, n - 1)] - reference[max(k - 1, 0)]) * HZ / 2
        i = loop[1] * (loop[0] * (reference[k] - theta) + ahead - w)
        out[0, k], out[1, k], out[2, k] = theta, w, i
        for _ in range(FINE):
            i_true = i_true + dt / a * (i - i_true) if kind == LAG else i
            motor, other, rubs, inertia = k_t * i_true, C * w, F, own * J
            if kind == CUSHION:
                deep = max(abs(theta) - a, 0.0)
                other += np.sign(theta) * (b * deep + c * deep * deep)
            elif kind == GAP:
                twist = theta - theta_l
                touch = twist - min(max(twist, -a), a)
                T = c * touch + (0.2 * np.sqrt(c * J) * (w - w_l) if touch != 0.0 else 0.0)
                other += T
                w_l += dt / (b * J) * T
                theta_l += dt * w_l
            elif kind == SLIP:
                rubs = 0.0
                for m in range(3):
                    stiff = F / 3.0 / (a * 3.0**m)
                    z[m] = min(max(z[m] + dt * w, -F / 3.0 / stiff), F / 3.0 / stiff)
                    other += stiff * z[m]
            elif kind == RIPPLE:
                motor *= 1.0 + a * np.sin(b * theta + c)
            elif kind == TWICE:
                rubs *= 1.0 + a * np.cos(b * theta + c)
            elif kind == CRANK:
                inertia *= 1.0 + a * np.cos(b * theta + c)
                other += -0.5 * J * a * b * np.sin(b * theta + c) * w * w
            elif kind == HEAT:
                rubs *= 1.0 - a * (1.0 - np.exp(-work / b))
                work += dt * rubs * abs(w)
            elif kind == CLUTCH:
                T = a * (w - w_l)
                other += T
                w_l += dt / (b * J) * T
            elif kind == FAN:
                other += a * w * w if w > 0.0 else 0.0
            elif kind in (GUSTS, SHAKEN):
                other += gusts[k]
            elif kind == STEP:
                other += a if k > b * n else 0.0
            elif kind == DWELL:
                rested = rested + dt if w == 0.0 else 0.0
                rubs *= 1.0 + a * (1.0 - np.exp(-rested / b))
            elif kind == BRAKE:
                other += a * np.sign(w) * max(abs(w) - b, 0.0)
            free = w + dt / inertia * (motor - other)
            stop = dt / inertia * rubs
            w = 0.0 if abs(free) <= stop else free - np.sign(free) * stop
            theta += dt * w


def draw(kind: int, axis: Axis, rng: np.random.Generator) -> tuple[np.ndarray, tuple[float, float, float]]:
    """Phases of the reference's sines, and `sizes`, as `record` has them of a generator of its seed."""
    phases = rng.uniform(0.0, 6.0, len(SINES))
    return phases, sizes(kind, axis, rng)


def record(name: str, axis: Axis, seed: int, *, seconds: float = 8.0, stiff: float = 1.0) -> Record:
    """Three sines over some turns of the motor; `stiff`: factor on the speed loop's gain."""
    rng = np.random.default_rng(seed)
    kind = KINDS.index(name)
    n = round(seconds * HZ)
    t = np.arange(n) / HZ
    reference = np.zeros(n)
    phases, q = draw(kind, axis, rng)
    for (size, f), phase in zip(SINES, phases, strict=True):
        reference += size * np.sin(2.0 * np.pi * f * t + phase)
    reference *= np.minimum(1.0, t / 0.3)
    gusts = np.zeros(n)
    if kind == GUSTS:
        fade = np.exp(-1.0 / (HZ * q[1]))
        for k in range(1, n):
            gusts[k] = fade * gusts[k - 1] + q[0] * np.sqrt(1.0 - fade**2) * rng.standard_normal()
    elif kind == SHAKEN:
        gusts = q[0] * np.sin(2.0 * np.pi * q[1] * t + q[2])
    out = np.empty((3, n))
    _run(reference, kind, (axis.J, axis.F, axis.C, axis.k_t), q, gusts, (40.0, 0.05 * stiff), out)
    theta, w, i = (x + s * rng.standard_normal(n) for x, s in zip(out, axis.noise, strict=True))
    return Record((Cycle(0, {"t": t, "theta_m": theta, "w_m": w, "i_q": i}),))


def plant(axis: Axis) -> dict[str, object]:
    """What its maker would write: nearly right friction."""
    return {"kind": "axis", "drive": "current", "J": axis.J, "F_d": 0.9 * axis.F, "C": axis.C, "k_t": axis.k_t}
