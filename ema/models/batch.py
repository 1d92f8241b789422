"""The batch of runs as the kernels take it: parameters of every run, and states to start from."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ema import faults
from ema.core.errors import ConfigError
from ema.effects import known, registry
from ema.effects.trapezoid import sector, six_step

from .actuator import Actuator
from .layout import N_ROWS, N_STATE, STATE, row

NO_FILTER = 1e-6  # of the time constants: far below a step
HELD = 1e9  # [N m] friction at the user that no load overcomes

Effects = Mapping[str, Mapping[str, float | np.ndarray]]


def parameters(plant: Actuator, k: np.ndarray, effects: Effects, dT: float | np.ndarray = 0.0) -> np.ndarray:
    """The batch array without state for fault vectors `k` (n, 6): shape (N_ROWS, n). Equations: `ema.faults`."""
    z = np.zeros((N_ROWS, len(k)))
    m, inv, g, c, s = plant.motor, plant.inverter, plant.transmission, plant.control, plant.sensors
    for j, phase in enumerate("abc"):
        N_j = faults.turns(k[:, 2 + j])
        z[row(f"R_{phase}")], z[row(f"L_{phase}")], z[row(f"k_{phase}")] = m.R * N_j, m.L * N_j**2, m.k_e * N_j
    z[row("F_s")], z[row("F_d")] = faults.friction(g.F_s, k[:, 0]), faults.friction(g.F_d, k[:, 0])
    z[row("F_u")] = HELD if g.F_u is None else g.F_u
    z[row("b")], z[row("zeta")], z[row("dT")] = faults.backlash(g.b, k[:, 1]), k[:, 5], dT
    for section, names in (
        (m, ("p", "theta_0", "phi", "J_m", "C")),
        (inv, ("V_dc", "h", "I_max")),
        (g, ("GR", "theta_stop")),
        (c, ("K_p", "K_w")),
        (s, ("lvdt_step", "f_lag")),
    ):
        for name in names:
            z[row(name)] = getattr(section, name)
    for name, effect in registry().items():
        for parameter in effect.parameters:
            z[row(f"{name}.{parameter.name}")] = parameter.neutral
    try:
        known(effects, "ema")
    except ValueError as error:
        raise ConfigError(str(error)) from error
    for name, values in effects.items():
        for parameter_name, value in values.items():
            z[row(f"{name}.{parameter_name}")] = value
    z[row("J_m")] *= 1.0 + z[row("inertia.change")]
    z[row("f_lag")] /= np.maximum(1.0 + z[row("current_filter.change")], NO_FILTER)
    return z


def cold_start(plant: Actuator, n: int) -> np.ndarray:
    """State at rest in the middle of the gap at position zero, shape (n, N_STATE)."""
    state = np.zeros((n, N_STATE))
    for phase in "abc":
        state[:, STATE.index(f"s_{phase}")] = 1.0
    state[:, STATE.index("u_dc")] = plant.inverter.V_dc
    return state


def start_at(
    plant: Actuator, theta_u: np.ndarray, theta_m: np.ndarray, theta_cmd: float | np.ndarray = 0.0
) -> np.ndarray:
    """State at rest at a measured user position and rotor angle (n,), shape (n, N_STATE).

    Held by stiction off its command, the motor carries the current that the controller asks for in vain, unless that is
    within the comparators' band: then it has died away.
    """
    theta_u, theta_m = np.atleast_1d(theta_u), np.atleast_1d(theta_m)
    state = cold_start(plant, len(theta_u))
    state[:, STATE.index("theta_u")] = theta_u
    state[:, STATE.index("theta_m")] = theta_m
    I_max = plant.inverter.I_max
    I_ref = np.clip(plant.control.K_w * plant.control.K_p * (theta_cmd - theta_u), -I_max, I_max)
    n = [sector(plant.motor.p * angle + plant.motor.theta_0) for angle in theta_m]
    for phase, turned in (("a", 0.0), ("b", -2.0), ("c", 2.0)):
        i = np.where(np.abs(I_ref) > plant.inverter.h, I_ref, 0.0) * [six_step(n_j + turned) for n_j in n]
        for name in (f"i_{phase}", f"lag1_{phase}", f"lag2_{phase}"):
            state[:, STATE.index(name)] = i
    state[:, STATE.index("I_ref")] = I_ref
    return state
