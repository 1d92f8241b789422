"""What of a cycle is compared: numbers that feel physics, and not the luck of each switching instant.

Two runs of the same actuator differ, sample by sample, by what decides its comparators. So a cycle is reduced to
short local averages of *balances*, each of which holds by itself and points at one part of the actuator:

=========  =====================================================================  ============================
torque     Σ κ_j i_j - J dω_m/dt - C ω_m, in weak form                            motor, friction, load
control    current less what the controller should ask for                        delays, sensors, controller
current    DC-equivalent current, signed                                          everything; carries the faults
tracking   θ_u - θ_cmd                                                            closed loop
gap        θ_m/GR - θ_u less its mean                                             gear: backlash, compliance
sum        i_a + i_b + i_c, which is zero in the motor                            current sensors
phase      currents by phase and electrical angle, plain and by sign of current   asymmetry, commutation, inverter
supply     u_dc less its mean                                                     supply
=========  =====================================================================  ============================

They are computed alike from measured and from simulated cycles; constants in them are nominal, so they are zero for
neither: it is the difference that counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit, vectorize

from ema.core.records import Array
from ema.effects.trapezoid import sector, six_step, trap
from ema.models import jit  # noqa: F401  where compiled functions are kept
from ema.models.actuator import Actuator

SECOND_DIFFERENCE = np.sqrt(6.0)  # rms of x[t] - 2 x[t-1] + x[t-2] over that of white x
SECTORS = 24  # per electrical turn
FEW = 20.0  # samples in a sector from which its mean counts half
I_SIGN = 0.3  # [A] current at which its sign is taken for half certain
MAX_NODES = 800
SETTLING = 5e-3  # [s] left out at the start of a cycle: what current the controller held before it is not known
# Local averages: distance of nodes [s], and the smallest standard deviation a feature is trusted with: what the
# sensors resolve, and what two honest implementations of the same equations may differ by.
GROUPS = {
    "torque": (1e-3, 1.0e-4, "N m"),
    "control": (2e-3, 2.0e-3, "A"),
    "current": (2e-3, 2.0e-3, "A"),
    "tracking": (2.5e-3, 5.0e-7, "rad"),
    "gap": (5e-3, 3.0e-7, "rad"),
    "sum": (25e-3, 3.0e-4, "A"),
    "phase": (0.0, 2.0e-3, "A"),
    "supply": (10e-3, 0.02, "V"),  # where no repetition tells (`supply.py`)
}

_trap = vectorize(nopython=True, cache=True)(lambda x: trap(x))
_six_step = vectorize(nopython=True, cache=True)(lambda x: six_step(sector(x)))
PHASE = np.array([0.0, 2.0, 4.0])[:, None] * np.pi / 3.0


@dataclass(frozen=True)
class Signals:
    """Channels of n runs or cycles of one length; batch axis first.

    Attributes
    ----------
    i : array, shape (n, 3, n_times)
        Phase currents. [A]
    theta_m, theta_u, theta_cmd : arrays, shape (n, n_times)
        [rad]
    u_dc : array, shape (n, n_times), or None
        Bus voltage, where it was recorded. [V]
    """

    i: Array
    theta_m: Array
    theta_u: Array
    theta_cmd: Array
    u_dc: Array | None


def spacing(seconds: float, rate: float, n_times: int) -> int:
    """Samples from one node to the next."""
    return max(round(seconds * rate), 2, n_times // MAX_NODES)


def roughness(x: Array) -> float:
    """Rms of the second difference along the last axis, as that of white noise of the same rms."""
    return float(np.sqrt(np.mean(np.diff(x, 2, axis=-1) ** 2))) / SECOND_DIFFERENCE


def local_mean(x: Array, m: int) -> Array:
    """Averages over triangles of ±m samples around every m-th sample but the first and last, (..., n_nodes)."""
    n_stretches = (x.shape[-1] - 1) // m
    stretches = x[..., : n_stretches * m].reshape(*x.shape[:-1], n_stretches, m)
    rising = np.arange(m) / m**2
    both = stretches @ np.stack([rising, 1.0 / m - rising], axis=1)
    return np.asarray(both[..., :-1, 0] + both[..., 1:, 1])


def nodes(x: Array, m: int) -> Array:
    """Values at the middle of the triangles of `local_mean`."""
    n_nodes = (x.shape[-1] - 1) // m - 1
    return np.asarray(x[..., m : m * (n_nodes + 1) : m])


def acceleration(theta: Array, m: int, T: float) -> Array:
    """Triangle-weighted mean of d²θ/dt²: exact for any course of θ, from its values at the nodes. [rad/s²]"""
    n_nodes = (theta.shape[-1] - 1) // m - 1
    x = theta[..., : m * (n_nodes + 1) + 1 : m]
    return np.asarray((x[..., 2:] - 2.0 * x[..., 1:-1] + x[..., :-2]) / (m * T) ** 2)


def delayed(x: Array, samples: float) -> Array:
    """The signal a (fractional) number of samples ago, or ahead where that is negative; its ends are held."""
    whole = int(np.floor(samples))
    share = samples - whole
    at, last = np.arange(x.shape[-1]) - whole, x.shape[-1] - 1
    return np.asarray((1.0 - share) * x[..., at.clip(0, last)] + share * x[..., (at - 1).clip(0, last)])


@njit(cache=True, nogil=True)
def _table(i: Array, sector: Array, sign: Array) -> Array:
    """Mean of each phase's current in each sector, plain and times the sign of the current: (n, 2, 3, SECTORS).

    Sectors overlap as triangles, and a mean fades where hardly a sample is: else it would jump with the slightest load
    that takes the rotor into one sector more.
    """
    n, _, n_times = i.shape
    total = np.zeros((n, 2, 3, SECTORS))
    for run in range(n):
        for j in range(3):
            count = np.zeros(SECTORS)
            for t in range(n_times):
                whole = int(sector[run, j, t])
                share = sector[run, j, t] - whole
                for s, weight in ((whole % SECTORS, 1.0 - share), ((whole + 1) % SECTORS, share)):
                    count[s] += weight
                    total[run, 0, j, s] += weight * i[run, j, t]
                    total[run, 1, j, s] += weight * i[run, j, t] * sign[run, t]
            for s in range(SECTORS):
                total[run, 0, j, s] /= count[s] + FEW
                total[run, 1, j, s] /= count[s] + FEW
    return total


def current_lag(plant: Actuator) -> float:
    """Samples by which the two anti-alias stages make the recorded currents late."""
    return 2.0 / (2.0 * np.pi * plant.sensors.f_lag) * plant.control.rate


def motor_torque(plant: Actuator, signals: Signals) -> tuple[Array, Array]:
    """Nominal torque Σ κ_j i_j (n, n_times), and electrical angles by phase (n, 3, n_times). [N m, rad]

    The angle is taken as late as the anti-alias stages make the current.
    """
    theta_e = plant.motor.p * delayed(signals.theta_m, current_lag(plant))[:, None, :] - PHASE
    return (plant.motor.k_e * _trap(theta_e) * signals.i).sum(axis=1), theta_e


def load_torque(plant: Actuator, tau: Array, theta_m: Array, m: int) -> Array:
    """Torque that friction and load take, τ_m - J_m dω_m/dt - C ω_m, in means of ±m samples (..., n_nodes). [N m]"""
    T = 1.0 / plant.control.rate
    w_m = np.gradient(theta_m, T, axis=-1)
    inertia, viscous = plant.motor.J_m * acceleration(theta_m, m, T), plant.motor.C * local_mean(w_m, m)
    return np.asarray(local_mean(tau, m) - inertia - viscous)


def dc_current(theta_e: Array, i: Array) -> Array:
    """DC-equivalent current with its sign, from electrical angles and currents by phase (n, 3, n_times). [A]"""
    return np.asarray(0.5 * (_six_step(theta_e) * i).sum(axis=1))


def reference_terms(plant: Actuator, signals: Signals) -> Array:
    """The two terms of what the controller asks for, K_w K_p (θ_cmd - θ_u) and -K_w ω_m, (2, n, n_times). [A]"""
    c = plant.control
    w_m = np.gradient(signals.theta_m, 1.0 / c.rate, axis=-1)
    return np.stack([c.K_w * c.K_p * (signals.theta_cmd - signals.theta_u), -c.K_w * w_m])


def reference(plant: Actuator, signals: Signals) -> Array:
    """Current that the controller asks for, from the channels it sees, (n, n_times). [A]"""
    limit = plant.inverter.I_max
    return np.asarray(np.clip(reference_terms(plant, signals).sum(axis=0), -limit, limit))


def features(plant: Actuator, signals: Signals) -> dict[str, Array]:
    """The groups of the table above, each (n, n_features)."""
    rate = plant.control.rate
    n_times = signals.theta_m.shape[1]
    m = {name: spacing(seconds, rate, n_times) for name, (seconds, _, _) in GROUPS.items()}
    tau, theta_e = motor_torque(plant, signals)
    i_q = dc_current(theta_e, signals.i)
    I_ref = reference(plant, signals)
    lag = current_lag(plant) + 0.5
    smooth = np.apply_along_axis(np.convolve, -1, i_q, np.ones(21) / 21.0, "same")
    turns = theta_e / (2.0 * np.pi)
    at = (turns - np.floor(turns)) * SECTORS  # a third of the time that % takes
    sign = smooth / (np.abs(smooth) + I_SIGN)
    skip = round(SETTLING * rate)
    table = _table(signals.i[:, :, skip:], at[:, :, skip:], sign[:, skip:])
    gap = local_mean(signals.theta_m / plant.transmission.GR - signals.theta_u, m["gap"])
    found = {
        "torque": load_torque(plant, tau, signals.theta_m, m["torque"]),
        "control": local_mean(i_q - delayed(I_ref, lag), m["control"]),
        "current": local_mean(i_q, m["current"]),
        "tracking": local_mean(signals.theta_u - signals.theta_cmd, m["tracking"]),
        "gap": gap - gap.mean(axis=-1, keepdims=True),
        "sum": local_mean(signals.i.sum(axis=1), m["sum"]),
    }
    if signals.u_dc is not None:
        u_dc = local_mean(signals.u_dc, m["supply"])
        found["supply"] = u_dc - u_dc.mean(axis=-1, keepdims=True)
    settled = {name: x[:, skip // m[name] :] for name, x in found.items()}
    return {**settled, "phase": table.reshape(len(table), -1)}


def stacked(groups: dict[str, Array]) -> Array:
    """All groups side by side, (n, n_features)."""
    return np.concatenate(list(groups.values()), axis=1)


def slices(groups: dict[str, Array]) -> dict[str, slice]:
    """Where each group stands in `stacked`."""
    ends = np.cumsum([x.shape[1] for x in groups.values()])
    return {name: slice(end - x.shape[1], end) for (name, x), end in zip(groups.items(), ends, strict=True)}


def floors(groups: dict[str, Array]) -> Array:
    """Smallest standard deviation of each feature, (n_features,)."""
    return np.concatenate([np.full(x.shape[1], GROUPS[name][1]) for name, x in groups.items()])
