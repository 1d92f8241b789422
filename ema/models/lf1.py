"""LF1, the simplified dynamic model of the paper (section 2.2): an equivalent single-phase DC motor, steps of 10 µs.

    L(θ) di/dt = v - R(θ) i - K(θ) ω_m,    τ_m = K(θ) i,    v = clip(G (I_ref - i) + R i + K ω_m, ±V_dc)

Two of the three phases conduct in series, so R, L and K are sums over the conducting pair (`six_step`); a short of a
phase and the eccentricity modulate them with the rotor's angle. The comparators become a proportional gain G within
the bus voltage (a sign block with a linear middle), stable at ten times the HF step. Mechanics and control are HF's
own functions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit

from ema import faults
from ema.effects.trapezoid import sector, six_step, trap
from ema.effects.vector_math import TWO_PI, cos, sin

from . import hf_kernel as m
from . import jit
from .actuator import Actuator
from .batch import parameters, start_at
from .envelope import smoothed
from .hf import N_LANES
from .layout import N_STATE, row

DT = 1e-5  # [s]
GAIN = 0.5  # G DT / L; unstable from 2


@dataclass(frozen=True)
class Tuning:
    """What the builder fits to HF: factors on the torque and EMF coefficient K and on friction."""

    torque: float = 1.0
    friction: float = 1.0

    def as_array(self) -> np.ndarray:
        """Shape (2,), as kept in a bundle."""
        return np.array([self.torque, self.friction])


def simulate(plant: Actuator, k: np.ndarray, tuning: Tuning = Tuning(), start: np.ndarray | None = None) -> np.ndarray:
    """Envelopes of a batch of fault vectors.

    Parameters
    ----------
    k : array, shape (n, 6)
    start : array, shape (2,), optional
        User position and gear output when the cycle begins. [rad, rad]

    Returns
    -------
    i : array, shape (n, n_times)
        Envelope. [A]
    """
    k = faults.checked(k)
    n, command = len(k), plant.command()
    z = parameters(plant, k, {})
    for name in ("k_a", "k_b", "k_c"):
        z[row(name)] *= tuning.torque
    for name in ("F_s", "F_d"):
        z[row(name)] *= tuning.friction
    theta_u, theta_g = np.hsplit(np.zeros(2) if start is None else np.asarray(start), 2)
    z[:N_STATE] = start_at(plant, theta_u, theta_g * plant.transmission.GR).T
    i = np.empty((n, len(command)))
    for first in range(0, n, N_LANES):
        lanes = np.minimum(np.arange(first, first + N_LANES), n - 1)
        out = np.empty((len(command), N_LANES))
        zb = np.ascontiguousarray(z[:, lanes]).ravel()
        integrate(zb, command, out, DT, round(1.0 / (plant.control.rate * DT)), (0,) * N_LANES)
        i[first : first + N_LANES] = out.T[: n - first]
    return smoothed(np.abs(i), plant.control.rate)


def anchored(plant: Actuator, tuning: Tuning, i0: np.ndarray) -> Callable[..., np.ndarray]:
    """LF1 that tells deviations from HF's nominal envelope:   i(k, start) = i₀ + i_LF1(k, start) - i_LF1(0)

    What LF1 gets wrong without faults is known, whatever else it gets wrong.

    Parameters
    ----------
    i0 : array, shape (n_times,)
        Mean envelope of HF without faults. [A]
    """
    offset = i0 - simulate(plant, np.zeros((1, faults.N_FAULTS)), tuning)[0]
    return lambda k, start=None: simulate(plant, k, tuning, start) + offset


@m._jit
def electrical_step(z, l, N, dt):
    """Advance the current by one step and return the motor torque."""
    i, theta_m, w_m, p = z[m.I_A * N + l], z[m.THETA_M * N + l], z[m.W_M * N + l], z[m.P * N + l]
    zeta, theta_e = z[m.ZETA * N + l], p * theta_m + z[m.THETA_0 * N + l]
    c, s = cos(theta_m + z[m.PHI * N + l]), sin(theta_m + z[m.PHI * N + l])
    n = sector(theta_e)
    s_a, s_b, s_c = six_step(n), six_step(n - 2.0), six_step(n + 2.0)
    K_a = z[m.K_A * N + l] * (1.0 + zeta * c) * trap(theta_e) * s_a
    K_b = z[m.K_B * N + l] * (1.0 + zeta * (c * m.COS_THIRD + s * m.SIN_THIRD)) * trap(theta_e - m.THIRD) * s_b
    K_c = z[m.K_C * N + l] * (1.0 + zeta * (c * m.COS_THIRD - s * m.SIN_THIRD)) * trap(theta_e + m.THIRD) * s_c
    K = K_a + K_b + K_c
    R = abs(s_a) * z[m.R_A * N + l] + abs(s_b) * z[m.R_B * N + l] + abs(s_c) * z[m.R_C * N + l]
    L = abs(s_a) * z[m.L_A * N + l] + abs(s_b) * z[m.L_B * N + l] + abs(s_c) * z[m.L_C * N + l]
    V_dc = z[m.V_DC * N + l]
    v = min(max(GAIN * L / dt * (z[m.I_REF * N + l] - i) + K * w_m + R * i, -V_dc), V_dc)
    i_next = i + dt / L * (v - R * i - K * w_m)
    z[m.I_A * N + l] = i_next
    g = TWO_PI * z[m.F_LAG * N + l] * dt
    z[m.LAG1_A * N + l] += g * (i_next - z[m.LAG1_A * N + l])
    z[m.LAG2_A * N + l] += g * (z[m.LAG1_A * N + l] - z[m.LAG2_A * N + l])
    return K * i_next


@njit(fastmath=jit.FAST, error_model="numpy", cache=True, nogil=True)
def integrate(z, command, out, dt, n_substeps, lanes):
    """Run a batch of lanes over all ticks of `command` (n_ticks,); `out` (n_ticks, n_lanes) gets the current. [A]"""
    N = len(lanes)
    for tick in range(command.shape[0]):
        for l in range(N):
            m.control(z, l, N, command[tick], z[m.THETA_U * N + l], z[m.W_M * N + l])
            out[tick, l] = z[m.LAG2_A * N + l]
        for _ in range(n_substeps):
            for l in range(N):
                tau_m = electrical_step(z, l, N, dt)
                m.mechanical_step(z, l, N, dt, tau_m, (), ())
