"""A gear train that gives: its resonance from rotor and user alone, found without simulating the motor.

A resonance is no small change of anything, so no finite difference points at it. But with the measured rotor as input,
the user behind a spring is a small model of its own,

    J_u dω_u/dt = K (δ - σ θ_u) + 2 ζ √(K J_u) (ω_m/GR - ω_u) - C_u ω_u - friction(F_u),
    δ = deflection(θ_u, θ_m/GR, b)

(the damper acts where the gap is closed), in which only K/J_u, ζ, C_u/J_u, F_u/J_u and σ matter for θ_u; the torque
balance of the motor, which accelerates J_u too, then tells J_u. Drag, friction and a spring at the user are left out
where they make little difference, and so is a reading of θ_u that is late: what turns the phase alone is no drag, which
takes from the swing too. A spring twists the gear by more than the resonance does in slow motion.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.optimize import least_squares, minimize

from ema.core.records import Array
from ema.effects.backlash import deflection
from ema.effects.dry_friction import rubbing_speed_after
from ema.faults import backlash
from ema.models import jit  # noqa: F401  where compiled functions are kept
from ema.models.actuator import Actuator

from .features import (
    GROUPS,
    acceleration,
    current_lag,
    delayed,
    load_torque,
    local_mean,
    motor_torque,
    roughness,
    spacing,
)
from .held import PLAYS, held_user
from .measured import Measured

FREQUENCIES = np.geomspace(100.0, 2000.0, 32)  # [rad/s]
DAMPINGS = (0.01, 0.03, 0.1, 0.3)
WIDER = (1.0, 4.0)  # times the nominal backlash
LEAST_PLAY = 1e-8  # [rad at the user] less is none
LOUD = 3.0  # times the noise of θ_u, from where what a gear alone leaves is asked for one of these beside it
CLEAR = 0.7  # share of the squared gap's change from which a resonance is worth simulating
CLEARER = 0.2  # of what play or a gear alone leaves, where one of these is asked for
INERTIAS = (2e-3, 9.0)  # [kg m²]
RINGS = 0.4  # damping ratio
N_CYCLES = 4
N_TURNS, N_STEPS = 2, 28  # turns of a fit, steps of each per parameter
FIRST_SWING = 8.0  # [rad] of the resonance
N_SUBSTEPS = 5  # of a sample, else the resonance comes out a hundredth too low
MOVING = 10.0  # [rad/s] slower, dry friction takes up what it likes
SCALE = 0.05  # what weak magnets or shorts make of the torque's scale, a priori
REST = 0.1  # [N m] what is left of a cycle's torque balance, root of the sum of squares


class Resonance(NamedTuple):
    """Start values of the effect `gear_compliance`, in its units; and what comes with them.

    `spring` is the stiffness of a spring at the user that shows with it [N m/rad], `k2` the fault beside it, `starts`
    are θ_u as it is read and ω_u at the start of each cycle, shape (n_cycles, 2). [rad, rad/s]
    """

    compliance: float
    inertia: float
    damping: float
    drag: float
    friction: float
    spring: float
    k2: float
    starts: Array


class Beside(NamedTuple):
    """What a fit of a gear begins with beside it, in the units of `Gear`; what is zero stays so."""

    drag: float = 0.0
    friction: float = 0.0
    late: float = 0.0
    spring: float = 0.0


NONE = Beside()
BESIDE = (  # where these are asked for
    Beside(drag=30.0, friction=1e-3),
    Beside(drag=30.0, friction=5.0),
    Beside(late=2.0),
    Beside(late=10.0),
    Beside(spring=0.01),
    Beside(spring=0.06),
    Beside(drag=30.0, friction=1e-3, spring=0.01),
)


class Gear(NamedTuple):
    """What θ_u tells of a gear that gives: √(K/J_u) [rad/s], ζ, b [rad], C_u/J_u [1/s], F_u/J_u [rad/s²].

    `late` is by how much θ_u is read late [samples], `spring` the stiffness of a spring at the user over K.
    """

    w_0: float
    zeta: float
    b: float
    drag: float = 0.0
    friction: float = 0.0
    late: float = 0.0
    spring: float = 0.0

    @property
    def rings(self) -> bool:
        """Whether this is a resonance that can be seen, and no mere lag, which a late sensor has too."""
        return self.w_0 < FREQUENCIES[-1] and self.zeta + 0.5 * self.drag / self.w_0 < RINGS


class Found(NamedTuple):
    """A gear as θ_u tells it.

    `starts` are θ_u and ω_u at the start of each cycle, shape (n_cycles, 2), by the zero of the rotor. The user's
    sensor may have another, and a load bends the gear: by what θ_u is `off` in the mean of each cycle, it does not
    swing. `left` is the sum of variances of θ_u about it.
    """

    gear: Gear
    starts: Array
    off: Array
    left: float


@njit(cache=True, nogil=True)
def _user(shaft: Array, start: Array, gear: Gear, T: float) -> Array:
    """θ_u of a user behind a spring, driven by θ_m/GR; `start`: its θ_u and ω_u. [rad]"""
    w_0, zeta, b, drag, friction, _, spring = gear
    theta, w = start[0], start[1]
    out = np.empty(len(shaft))
    out[0] = theta
    dt = T / N_SUBSTEPS
    for t in range(1, len(shaft)):
        w_shaft = (shaft[t] - shaft[t - 1]) / T
        for n in range(N_SUBSTEPS):
            twist = deflection(theta, shaft[t - 1] + (n + 0.5) * dt * w_shaft, b)
            push = w_0 * w_0 * (twist - spring * theta) - drag * w
            if twist != 0.0:
                push += 2.0 * zeta * w_0 * (w_shaft - w)
            w = rubbing_speed_after(w, push, friction, dt)
            theta += dt * w
        out[t] = theta
    return out


def _read(shaft: Array, start: Array, gear: Gear, T: float) -> Array:
    """θ_u of `_user` as it is read. [rad]"""
    return delayed(_user(shaft, start, gear, T), gear.late)


def start_swinging(data: Measured, found: Resonance | None) -> Measured:
    """The cycles with the user starting as a gear that gives lets it, which no parabola tells; as they are if stiff."""
    if found is None:
        return data
    start = np.stack([found.starts[:, 0], data.start[:, 1]], axis=1)
    return replace(data, start=start, user_speed=found.starts[:, 1])


def find_resonance(plant: Actuator, data: Measured) -> Resonance | None:
    """The likeliest resonance of the gear train, None where a stiff one explains the user as well."""
    T = 1.0 / plant.control.rate
    users = [s.theta_u[0] for s in data.signals]
    shafts = [np.ascontiguousarray(s.theta_m[0] / plant.transmission.GR) for s in data.signals]
    n = len(users[:N_CYCLES])
    stiff = sum(float(np.var(user - shaft)) for shaft, user in zip(shafts[:n], users, strict=False))
    as_noise = n * (LOUD * max(roughness(user) for user in users)) ** 2
    found = _gear(plant, shafts, users, data, NONE, CLEAR * stiff)
    left = stiff if found is None else found.left
    starts = data.start[:n, 0].tolist()
    held = min(_left_by_play(shafts, users, starts, b) for b in backlash(plant.transmission.b, PLAYS).tolist())
    if min(left, held) > as_noise:
        tried = (_gear(plant, shafts, users, data, c, CLEARER * min(left, held)) for c in BESIDE)
        found = min((g for g in tried if g is not None), key=lambda g: g.left, default=found)
    if found is None:
        return None
    gear, starts, off, _ = found
    swinging = [_user(s, start, gear, T) for s, start in zip(shafts, starts, strict=True)]
    inertia = _inertia(plant, data, swinging, sprung=gear.spring > 0.0)
    nominal = plant.transmission.b
    k2 = (gear.b / nominal - 1.0) / (backlash(1.0, 1.0) - 1.0) if nominal > LEAST_PLAY else 0.0
    return Resonance(
        1.0 / (gear.w_0**2 * inertia),
        inertia,
        float(np.clip(gear.zeta, 0.005, 0.5)),
        gear.drag * inertia,
        gear.friction * inertia,
        gear.spring * gear.w_0**2 * inertia,
        float(np.clip(k2, 0.0, 1.0)),
        np.stack([starts[:, 0] + off, starts[:, 1]], axis=1),
    )


def _left_by_play(shafts: list[Array], users: list[Array], starts: list[float], b: float) -> float:
    """What a stiff gear with a play leaves of θ_u; `shafts` and `users` of as many cycles as there are `starts`."""
    cycles = zip(shafts, users, starts, strict=False)
    return sum(float(np.var(user - held_user(shaft, start, b))) for shaft, user, start in cycles)


def _gear(
    plant: Actuator,
    shafts: list[Array],
    users: list[Array],
    data: Measured,
    beside: Beside,
    least: float,
) -> Found | None:
    """A gear and the starts of its user, begun with what is `beside` it.

    None where more than `least` is left of θ_u, or what is left needs no resonance.
    """
    T = 1.0 / plant.control.rate
    off = np.array([np.mean(user - shaft) for shaft, user in zip(shafts, users, strict=True)])
    starts = np.stack([data.start[:, 0] - off, data.user_speed], axis=1)
    free = np.flatnonzero([1.0, 1.0, 1.0, *beside])

    def gear(x: Array) -> Gear:
        of = np.zeros(len(Gear._fields))
        of[free] = np.exp(x)
        return Gear(*of.tolist())

    def misfit(g: Gear) -> float:
        if not 0.5 * FREQUENCIES[0] < g.w_0 < 2.0 * FREQUENCIES[-1] or g.zeta > 1.0:
            return np.inf
        cycles = zip(shafts[:N_CYCLES], users, starts, strict=False)
        return sum(float(np.var(user - _read(shaft, start, g, T))) for shaft, user, start in cycles)

    play = max(plant.transmission.b, LEAST_PLAY)
    grid = [Gear(w, z, play * x, *beside) for w in FREQUENCIES for z in DAMPINGS for x in WIDER]
    best = min(grid, key=misfit)
    left = np.inf
    for _ in range(N_TURNS):  # the gear by the starts, the starts by the gear
        found = minimize(
            lambda x: misfit(gear(x)),
            np.log(np.array(best)[free]),
            method="Nelder-Mead",
            options={"maxiter": N_STEPS * len(free)},
        )
        best, left = gear(found.x), float(found.fun)
        if left > least:
            return None
        cycles = list(zip(shafts, users, starts, strict=True))
        off = np.array([np.mean(user - _read(shaft, start, best, T)) for shaft, user, start in cycles])
        starts = np.array([_fit_start(s, user - x, at, best, T) for (s, user, at), x in zip(cycles, off, strict=True)])
    return None if beside != NONE and not best.rings else Found(best, starts, off, left)


def _fit_start(shaft: Array, user: Array, start: Array, gear: Gear, T: float) -> Array:
    """θ_u and ω_u with which the first swing comes out as recorded."""
    n = round(FIRST_SWING / gear.w_0 / T + gear.late)
    solved = least_squares(
        lambda x: _read(shaft[:n], x, gear, T) - user[:n], start, x_scale=(1.0, gear.w_0), xtol=1e-10
    )
    return np.asarray(solved.x)


def _inertia(plant: Actuator, data: Measured, users: list[Array], *, sprung: bool) -> float:
    """Inertia at the user that closes the motor's torque balance beside friction, and beside a spring. [kg m²]"""
    T = 1.0 / plant.control.rate
    A, y = [], []
    for s, user in zip(data.signals, users, strict=False):
        m = spacing(GROUPS["torque"][0], plant.control.rate, len(user))
        theta_m, user = (delayed(x, current_lag(plant)) for x in (s.theta_m[0], user))
        w_m = np.gradient(theta_m, T)
        motor = motor_torque(plant, s)[0][0]
        tau = local_mean(motor, m)
        signs, speed = local_mean(np.tanh(w_m / 2.0), m), local_mean(w_m, m)
        a_u = acceleration(user, m, T)
        moving = np.abs(speed) > MOVING
        beside = [signs, speed, tau, np.ones_like(tau), *([local_mean(user, m)] if sprung else [])]
        A.append(np.stack([a_u / plant.transmission.GR, *beside])[:, moving])
        y.append(load_torque(plant, motor, theta_m, m)[moving])
    A.append(np.eye(len(A[0]))[:, 3:4] * REST / SCALE)
    y.append(np.zeros(1))
    coefficients, *_ = np.linalg.lstsq(np.concatenate(A, axis=1).T, np.concatenate(y), rcond=1e-9)
    return float(np.clip(coefficients[0], *INERTIAS))
