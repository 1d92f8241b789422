"""Other simulators of electric drives at the kernel's time scale: processor time for one simulated second.

Each peer is run as its own documentation does, at a step of 1 µs, for as long as gives a steady figure. None has
stiction, backlash, hysteresis control and faults together; `scipy_events` solves this project's own equations.
A peer that is not installed (extra: bench-peers) answers None.
"""

from __future__ import annotations

import contextlib
import io
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp

from ema.effects.backlash import follow
from ema.effects.trapezoid import sector, six_step
from ema.models import hf
from ema.models import hf_kernel as m
from ema.models.actuator import Actuator
from ema.models.layout import N_STATE, STATE

DT = 1e-6  # [s]
PAIR = 1e-8  # distance of the two states a slope is taken from [s]


def gym_electric_motor() -> float:
    """Finite-control-set PMSM drive, one `env.step` for each step."""
    import gym_electric_motor as gem

    drive = gem.make("Finite-CC-PMSM-v0", tau=DT)
    drive.reset()

    def steps(n: int) -> None:
        for number in range(n):
            if drive.step(number % 8)[2]:
                drive.reset()

    return _per_second(steps, 2000)


def progpy() -> float:
    """NASA's Powertrain: speed controller with PWM and brushless motor, one `next_state` for each step."""
    from progpy.models import ESC, DCMotor, Powertrain

    model = Powertrain(ESC(), DCMotor())
    u = model.InputContainer({"duty": 0.5, "v": 23.0})

    def steps(n: int) -> None:
        x = model.initialize()
        for _ in range(n):
            x = model.next_state(x, u, DT)

    return _per_second(steps, 2000)


def motulator() -> float:
    """Synchronous drive under current-vector control, inverter at switching level, `max_step` 1 µs."""
    from motulator.drive import model
    from motulator.drive.control import sm
    from motulator.drive.utils import SynchronousMachinePars

    par = SynchronousMachinePars(n_p=2, R_s=1.065, L_d=0.36e-3, L_q=0.36e-3, psi_f=0.0188)
    drive = model.Drive(
        model.VoltageSourceConverter(u_dc=48.0),
        model.SynchronousMachine(par),
        model.StiffMechanicalSystem(J=2.5e-5),
    )
    drive.pwm = model.CarrierComparison()
    control = sm.CurrentVectorControl(par, sm.CurrentReferenceCfg(par, max_i_s=22.5, nom_w_m=200.0), T_s=1e-4, J=2.5e-5)
    control.ref.w_m = lambda t: 100.0
    simulation = model.Simulation(drive, control)
    ends = iter(range(1, 100))

    def steps(n: int) -> None:
        simulation.simulate(t_stop=next(ends) * n * DT, max_step=DT)

    return _per_second(steps, 2000)


def scipy_events(plant: Actuator) -> float:
    """solve_ivp on this project's equations: comparators and stopping as terminal events, control each 0.1 ms."""
    z = hf.parameters(plant, np.zeros((1, 6)), {})[:, 0]
    begin = plant.n_samples // 2  # in full motion
    z[:N_STATE] = hf.simulate(plant, np.zeros((1, 6)), plant.command()[:begin]).state[0]
    h, z[m.H] = z[m.H], np.inf  # the step's own comparators rest; the events switch
    held = ("i_c", "s_", "off_", "theta_u", "w_u", "u_dc", "angle_error", "I_ref")  # i_c and θ_u follow from the others
    moving = np.array([row for row in range(N_STATE) if not STATE[row].startswith(held)])
    place = {row: n for n, row in enumerate(moving)}
    T, command = 1.0 / plant.control.rate, plant.command()[begin - 1 :]

    def switch(j: int) -> Callable[..., float]:
        def event(t: float, y: np.ndarray) -> float:
            theta_e = z[m.P] * y[place[m.THETA_M]] + z[m.THETA_0]
            wanted = z[m.I_REF] * six_step(sector(theta_e) - (0.0, 2.0, -2.0)[j])
            i_j = y[place[m.I_A + j]] if j < 2 else -y[place[m.I_A]] - y[place[m.I_B]]
            return float(z[m.S_A + j] * (wanted - i_j) + h)

        event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
        return event

    def stopping(t: float, y: np.ndarray) -> float:
        return float(y[place[m.W_M]])

    stopping.terminal = True  # type: ignore[attr-defined]
    events = [switch(0), switch(1), switch(2), stopping]

    def steps(n: int) -> None:
        y = z[moving]
        for tick in range(round(n * DT / T)):
            t, end = tick * T, (tick + 1) * T
            m.control(z, 0, 1, command[tick], z[m.THETA_U], y[place[m.W_M]])
            while t < end:
                for j in range(3):  # what the sector's change or the new reference has switched
                    if events[j](t, y) < 0.0:
                        z[m.S_A + j] *= -1.0
                watched = events if y[place[m.W_M]] != 0.0 else events[:3]
                found = solve_ivp(lambda _, y: _slope(z, moving, y), (t, end), y, events=watched, max_step=T / 4)
                t, y = float(found.t[-1]), found.y[:, -1].copy()
                z[m.THETA_U] = follow(z[m.THETA_U], y[place[m.THETA_M]] / z[m.GR], z[m.B])
                if found.status == 1:
                    which = next(n for n, times in enumerate(found.t_events) if len(times))
                    if which == 3:
                        y[place[m.W_M]] = 0.0
                    else:
                        z[m.S_A + which] *= -1.0

    steps(200)
    return _per_second(steps, 2000)


@njit(error_model="numpy")
def _slope(z: np.ndarray, moving: np.ndarray, y: np.ndarray) -> np.ndarray:
    """dy/dt from the kernel's own step."""
    after = z.copy()
    after[moving] = y
    after[m.I_C] = -after[m.I_A] - after[m.I_B]
    tau_m = m.electrical_step(after, 0, 1, PAIR, (), ())
    m.mechanical_step(after, 0, 1, PAIR, tau_m, (), ())
    return (after[moving] - y) / PAIR


def measured(plant: Actuator) -> dict[str, float | None]:
    """Processor time of each peer for a simulated second [s]; None: not installed."""
    peers: dict[str, Callable[[], float]] = {
        "gym-electric-motor": gym_electric_motor,
        "ProgPy Powertrain": progpy,
        "motulator, switching": motulator,
        "scipy, event-driven": lambda: scipy_events(plant),
    }
    found: dict[str, float | None] = {}
    for name, peer in peers.items():
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            try:
                found[name] = peer()
            except ImportError:
                found[name] = None
    return found


def _per_second(steps: Callable[[int], Any], n: int) -> float:
    """Processor time for a simulated second, from `n` steps, the better of two."""
    took = []
    for _ in range(2):
        began = time.process_time()
        steps(n)
        took.append(time.process_time() - began)
    return min(took) / (n * DT)
