"""The high-fidelity model: batches of independent runs, 16 in lockstep on a core, all cores."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import compress

import numpy as np
from scipy.interpolate import CubicSpline

from ema import faults
from ema.core.errors import ConfigError
from ema.effects import known, registry
from ema.effects.trapezoid import sector, six_step

from . import parts
from .actuator import Actuator
from .envelope import envelope
from .hf_kernel import OUTPUTS, integrate
from .layout import ENERGIES, N_ROWS, N_STATE, STATE, row

N_LANES = 16
DT = 1e-6  # [s]
NO_FILTER = 1e-6  # of the time constants: far below a step
HELD = 1e9  # [N m] friction at the user that no load overcomes
N_RING = 64  # control ticks remembered for delays at least

Effects = Mapping[str, Mapping[str, float | np.ndarray]]


@dataclass(frozen=True)
class Response:
    """What a batch of n runs answered.

    Attributes
    ----------
    t : array, shape (n_times,)
        Sample times. [s]
    i : array, shape (n, 3, n_times)
        Phase currents as the recorder reads them: anti-alias stages, noise, ADC. [A]
    theta_m, theta_u, w_m, u_dc, I_ref : arrays, shape (n, n_times)
        Rotor angle by resolver, user position by LVDT, speed, bus voltage, reference current. [rad, rad, rad/s, V, A]
    state : array, shape (n, N_STATE)
        State at the end, to be handed to the next cycle as `start`.
    energy : dict of arrays, shape (n,), or empty
        Energy sums if the run was audited. [J]
    """

    t: np.ndarray
    i: np.ndarray
    theta_m: np.ndarray
    theta_u: np.ndarray
    w_m: np.ndarray
    u_dc: np.ndarray
    I_ref: np.ndarray
    state: np.ndarray
    energy: dict[str, np.ndarray]

    @property
    def envelope(self) -> np.ndarray:
        """Envelope current of each run, shape (n, n_times). [A]"""
        return envelope(self.i, 1.0 / (self.t[1] - self.t[0]))


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


def simulate(
    plant: Actuator,
    k: np.ndarray,
    command: np.ndarray | None = None,
    *,
    seeds: np.ndarray | int = 0,
    start: np.ndarray | None = None,
    effects: Effects | None = None,
    dT: float | np.ndarray = 0.0,
    noise: bool = True,
    dt: float = DT,
    audited: bool = False,
    n_threads: int = 1,
) -> Response:
    """Run the HF model on a batch of fault vectors.

    Parameters
    ----------
    plant : Actuator
    k : array, shape (n, 6) or (6,)
        Fault vectors, each element 0…1.
    command : array, shape (n_times,) or (n, n_times), optional
        Commanded user position at the control rate; the plant's own test motion if not given. [rad]
    seeds : int or array of int, shape (n,)
        Seed of each run's noise. A run's record depends on its own seed only, not on its place in the batch.
    start : array, shape (n, N_STATE) or (1, N_STATE), optional
        State at the start, from `Response.state` or `start_at`; at rest at zero if not given.
    effects : mapping of effect name to parameter values, each a float or an array of shape (n,), optional
        Terms beyond the plant's own (`plant.effects`, which these overwrite).
    dT : float or array, shape (n,)
        Winding temperature less 20 °C. [K]
    noise : bool
        False: neither sensor noise nor current ADC (the LVDT's quantisation belongs to the control and stays).
    dt : float
        Step; a divisor of the control period. [s]
    audited : bool
        Keep energy sums.
    n_threads : int
        Cores to use; the result does not depend on it.

    Returns
    -------
    Response
    """
    k = faults.checked(k)
    n = len(k)
    merged: dict[str, Mapping[str, float | np.ndarray]] = {**plant.effects, **(effects or {})}
    T = 1.0 / plant.control.rate
    n_substeps = round(T / dt)
    if abs(n_substeps * dt - T) > 1e-9 * T or n_substeps < 1:
        raise ConfigError(f"step {dt:g} s does not divide the control period {T:g} s")
    command = plant.command() if command is None else np.asarray(command, dtype=float)
    command = np.broadcast_to(np.atleast_2d(command), (n, np.shape(command)[-1]))
    n_recorded = command.shape[1]
    start = cold_start(plant, n) if start is None else np.broadcast_to(np.atleast_2d(start), (n, N_STATE))
    seeds = np.broadcast_to(np.asarray(seeds), (n,))

    z = parameters(plant, k, merged, dT)
    active = np.array([_is_active(z, name) for name in merged]).reshape(len(merged), n)
    z[:N_STATE] = start.T
    shared = z[row("clock_skew.shared")].copy()  # batches write to z
    skew = z[row("clock_skew.rate")].copy()
    beyond = np.ceil(np.maximum(skew, 0.0) * n_recorded).astype(int)  # samples that a slow recorder takes later
    lvdt_noise = np.zeros((n, n_recorded))
    current_noise = np.zeros((n, 3, n_recorded))
    if noise:
        for run, seed in enumerate(seeds):
            rng = np.random.default_rng(int(seed))
            lvdt_noise[run] = plant.sensors.lvdt_noise * rng.standard_normal(n_recorded)
            current_noise[run] = plant.sensors.current_noise * rng.standard_normal((3, n_recorded))

    longest = max(z[row(f"{signal}_delay.time")].max() for signal in ("position", "speed"))
    ticks = min(longest / (T * (1.0 + shared.min())), n_recorded)  # before the first sample there is nothing to see
    n_ring = max(N_RING, int(np.ceil(ticks)) + 2)

    n_lanes = 1 if n == 1 else N_LANES
    out = np.empty((n, len(OUTPUTS), n_recorded))
    t = np.arange(n_recorded) * T

    def batch(runs: np.ndarray) -> None:
        lanes = np.concatenate([runs, np.repeat(runs[-1:], n_lanes - len(runs))])  # the last run fills up the batch
        more = (0, 0), (0, beyond[runs[0]])
        zb = np.ascontiguousarray(z[:, lanes]).ravel()
        ob = np.empty((len(OUTPUTS), n_recorded + beyond[runs[0]], n_lanes))
        history = np.zeros((2, n_ring, n_lanes))
        integrate(
            zb,
            np.ascontiguousarray(np.pad(command[lanes], more, mode="edge").T),
            np.ascontiguousarray(np.pad(lvdt_noise[lanes], more).T),
            ob,
            history,
            dt * (1.0 + shared[runs[0]]),
            n_substeps,
            (0,) * n_lanes,
            (0,) * parts.needed(list(compress(merged, active[:, runs[0]]))),
            (0,) * audited,
        )
        z[:, runs] = zb.reshape(N_ROWS, n_lanes)[:, : len(runs)]
        for run, channels in zip(runs, ob.transpose(2, 0, 1), strict=False):
            if skew[run]:
                channels = CubicSpline(np.arange(channels.shape[1]) * T, channels, axis=1)(t * (1.0 + skew[run]))
            out[run] = channels

    of, kinds = np.unique(np.stack([shared, beyond, *active]), axis=1, return_inverse=True)
    alike = [np.flatnonzero(kinds.ravel() == kind) for kind in range(of.shape[1])]  # equations, steps, length of a step
    batches = [runs[first : first + n_lanes] for runs in alike for first in range(0, len(runs), n_lanes)]
    if n_threads > 1 and len(batches) > 1:
        with ThreadPoolExecutor(n_threads) as pool:
            list(pool.map(batch, batches))
    else:
        for runs in batches:
            batch(runs)

    i = out[:, :3] + current_noise
    if noise:
        limit = np.minimum(z[row("adc_saturation.limit")], plant.sensors.adc_range)[:, None, None]
        i = quantised(plant, np.clip(i, -limit, limit))
    channels = dict(zip(OUTPUTS[3:], out.transpose(1, 0, 2)[3:], strict=True))
    energy = {name: z[row(name)].copy() for name in ENERGIES} if audited else {}
    return Response(t=t, i=i, state=z[:N_STATE].T.copy(), energy=energy, **channels)


def _is_active(z: np.ndarray, name: str) -> np.ndarray:
    """Whether an effect does anything in each run, shape (n,)."""
    return np.any([z[row(f"{name}.{p.name}")] != p.neutral for p in registry()[name].parameters], axis=0)


def quantised(plant: Actuator, i: np.ndarray) -> np.ndarray:
    """Currents rounded to the ADC's steps. [A]"""
    step = plant.sensors.adc_step
    return step * np.round(i / step)
