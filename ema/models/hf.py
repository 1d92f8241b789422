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
from ema.effects import registry

from . import parts
from .actuator import Actuator
from .batch import Effects, cold_start, parameters, start_at
from .envelope import envelope
from .hf_kernel import OUTPUTS, integrate
from .layout import ENERGIES, N_ROWS, N_STATE, row
from .recorder import write_as_recorded

N_LANES = 16
DT = 1e-6  # [s]
N_BEYOND = 32  # samples after the end are simulated in steps of so many
N_RING = 64  # control ticks remembered for delays at least

__all__ = ["DT", "N_LANES", "Effects", "Response", "cold_start", "parameters", "simulate", "start_at"]


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
    located: bool = False,
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
    located : bool
        Comparators turn where a current leaves its band, found within the step (`ema.models.switching`); else, as if
        asked once a step, at the next one.
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
    n_substeps = _substeps(T, dt)
    command = plant.command() if command is None else np.asarray(command, dtype=float)
    command = np.broadcast_to(np.atleast_2d(command), (n, np.shape(command)[-1]))
    n_recorded = command.shape[1]
    start = cold_start(plant, n) if start is None else np.broadcast_to(np.atleast_2d(start), (n, N_STATE))
    lvdt_noise, current_noise = _noise(plant, np.broadcast_to(seeds, (n,)) if noise else np.empty(0), n, n_recorded)

    z = parameters(plant, k, merged, dT)
    active = np.array([_is_active(z, name) for name in merged]).reshape(len(merged), n)
    acts_in = np.array([parts.needed(list(compress(merged, of_run))) for of_run in active.T])
    acts_in |= parts.LOCATED if located else 0
    z[:N_STATE] = start.T
    shared = z[row("clock_skew.shared")].copy()  # batches write to z
    clocks = z[[row(f"clock_skew.{name}") for name in ("rate", "currents", "late")]].T.copy()
    beyond = _beyond(clocks, T, n_recorded)
    n_ring = _ring(z, T, n_recorded)

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
            (0,) * int(acts_in[runs[0]]),
            (0,) * audited,
        )
        z[:, runs] = zb.reshape(N_ROWS, n_lanes)[:, : len(runs)]
        for run, channels in zip(runs, ob.transpose(2, 0, 1), strict=False):
            out[run] = _sampled(channels, t, clocks[run]) if clocks[run].any() else channels

    of, kinds = np.unique(np.stack([shared, beyond, acts_in]), axis=1, return_inverse=True)
    alike = [np.flatnonzero(kinds.ravel() == kind) for kind in range(of.shape[1])]  # length of a step, steps, equations
    batches = [runs[first : first + n_lanes] for runs in alike for first in range(0, len(runs), n_lanes)]
    if n_threads > 1 and len(batches) > 1:
        with ThreadPoolExecutor(n_threads) as pool:
            list(pool.map(batch, batches))
    else:
        for runs in batches:
            batch(runs)

    write_as_recorded(out, z, T)
    i = out[:, :3] + current_noise
    if noise:
        limit = np.minimum(z[row("adc_saturation.limit")], plant.sensors.adc_range)[:, None, None]
        i = quantised(plant, np.clip(i, -limit, limit))
    channels = dict(zip(OUTPUTS[3:], out.transpose(1, 0, 2)[3:], strict=True))
    energy = {name: z[row(name)].copy() for name in ENERGIES} if audited else {}
    return Response(t=t, i=i, state=z[:N_STATE].T.copy(), energy=energy, **channels)


def _beyond(clocks: np.ndarray, T: float, n_recorded: int) -> np.ndarray:
    """Samples that a slow recorder takes after the end, in steps of `N_BEYOND` so that like runs share a batch."""
    rate, currents, late = clocks.T
    last = np.maximum(rate * n_recorded, (rate + currents) * n_recorded + late / T)
    return N_BEYOND * np.ceil(np.maximum(last, 0.0) / N_BEYOND).astype(int)


def _sampled(channels: np.ndarray, t: np.ndarray, clocks: np.ndarray) -> np.ndarray:
    """Outputs of a run (n_outputs, n_ticks) as a recorder with other clocks samples them, (n_outputs, n_times)."""
    rate, currents, late = clocks
    course = CubicSpline(np.arange(channels.shape[1]) * (t[1] - t[0]), channels, axis=1)
    sampled = course(t * (1.0 + rate))
    if currents or late:  # before the first tick there is nothing to see
        sampled[:3] = course(np.maximum(t * (1.0 + rate + currents) + late, 0.0))[:3]
    return np.asarray(sampled)


def _substeps(T: float, dt: float) -> int:
    """Steps of `dt` in a control period `T`."""
    n = round(T / dt)
    if abs(n * dt - T) > 1e-9 * T or n < 1:
        raise ConfigError(f"step {dt:g} s does not divide the control period {T:g} s")
    return n


def _noise(plant: Actuator, seeds: np.ndarray, n: int, n_recorded: int) -> tuple[np.ndarray, np.ndarray]:
    """Noise of the LVDT (n, n_recorded) [rad] and of the currents (n, 3, n_recorded) [A]; none without seeds."""
    lvdt, current = np.zeros((n, n_recorded)), np.zeros((n, 3, n_recorded))
    for seed in np.unique(seeds):
        rng = np.random.default_rng(int(seed))
        alike = np.flatnonzero(seeds == seed)
        lvdt[alike] = plant.sensors.lvdt_noise * rng.standard_normal(n_recorded)
        current[alike] = plant.sensors.current_noise * rng.standard_normal((3, n_recorded))
    return lvdt, current


def _ring(z: np.ndarray, T: float, n_recorded: int) -> int:
    """Control ticks to be remembered for the delays of a batch: before the first sample there is nothing to see."""
    position = z[row("position_delay.time")] + z[row("controller_delay.time")]
    longest = max(position.max(), z[row("speed_delay.time")].max())
    ticks = min(longest / (T * (1.0 + z[row("clock_skew.shared")].min())), n_recorded)
    return max(N_RING, int(np.ceil(ticks)) + 2)


def _is_active(z: np.ndarray, name: str) -> np.ndarray:
    """Whether an effect does anything in each run, shape (n,)."""
    return np.any([z[row(f"{name}.{p.name}")] != p.neutral for p in registry()[name].parameters], axis=0)


def quantised(plant: Actuator, i: np.ndarray) -> np.ndarray:
    """Currents rounded to the ADC's steps. [A]"""
    step = plant.sensors.adc_step
    return step * np.round(i / step)
