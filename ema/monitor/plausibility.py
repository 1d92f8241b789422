"""Channels that read what the actuator cannot do: a dead sensor, a sum of currents that is none, a position that jumps.

Bounds are physical limits of the plant, or so many standard deviations of what its sensors' noise and steps explain;
none depends on how much the actuator moves. What a mechanical fault can do is no reason to doubt a sensor.
"""

from __future__ import annotations

from math import erf, log, sqrt

import numpy as np

from ema import faults
from ema.bus.span import MOTION_RATIO
from ema.core.status import Reason
from ema.models.actuator import Actuator

P_FALSE = 1e-9  # of taking a sound channel for a dead one, in a cycle
N_SD = 6.0  # standard deviations of the noise that no sound channel exceeds
WORST_GAIN = 0.1  # relative error of a current sensor beyond which it is defective: the effects' own range
N_WINDOWS = 10  # of a cycle, in each of which the currents' sum is looked at

_PHASES = (Reason.CURRENT_A, Reason.CURRENT_B, Reason.CURRENT_C)
_NOTHING = Reason(0)


class Plausibility:
    """Judges the channels of one actuator's cycles.

    Parameters
    ----------
    plant : Actuator
    """

    def __init__(self, plant: Actuator):
        sensors, gear = plant.sensors, plant.transmission
        self._noise = sqrt(sensors.current_noise**2 + sensors.adc_step**2 / 12)  # rms of a current sensor [A]
        self._full_scale = sensors.adc_range * (1.0 - 2.0 / 2**sensors.adc_bits)
        self._h = plant.inverter.h
        self._GR = gear.GR
        if sensors.current_noise > 0:  # most probable when the current is in the middle of a step
            self._stays = erf(sensors.adc_step / (2 * sqrt(2) * sensors.current_noise))
        else:
            self._stays = 1.0
        self._lvdt = sensors.lvdt_step + 2 * N_SD * sensors.lvdt_noise  # a resting LVDT's readings lie this close [rad]
        self._play = 2 * float(faults.backlash(gear.b, np.array(1.0))) + self._lvdt  # between user and rotor [rad]
        # No phase's back-EMF is above the whole link's voltage.
        self._farthest = plant.inverter.V_dc / plant.motor.k_e * MOTION_RATIO / plant.control.rate  # in a step [rad]
        # Every phase at its limit, and the friction of a failed bearing, on the rotor alone.
        torque = 3 * plant.motor.k_e * plant.inverter.I_max + float(faults.friction(gear.F_s, np.array(1.0)))
        self._jerk = torque / plant.motor.J_m * (MOTION_RATIO / plant.control.rate) ** 2  # change of a step [rad]

    def reasons(self, i: np.ndarray, missing: np.ndarray, motion: dict[str, np.ndarray]) -> Reason:
        """Which channels are implausible.

        Parameters
        ----------
        i : array, shape (3, n_times)
            Phase currents. [A]
        missing : array of bool, shape (n_times,)
            Where there is no current.
        motion : dict of arrays, shape (n_motion,)
            theta_u and theta_m (within one turn) at a tenth of the rate; NaN where missing. [rad]
        """
        gaps = bool(missing.any())
        there = i[:, ~missing] if gaps else i
        if there.shape[1] < 2:
            return _NOTHING
        return self._constant(there) | self._sum(i, missing if gaps else None) | self._positions(there, motion)

    def _constant(self, i: np.ndarray) -> Reason:
        """A current that never changes, though its sensor's noise alone would change it."""
        n = i.shape[1]
        if self._stays >= 1.0 or n * log(self._stays) > log(P_FALSE):
            return _NOTHING
        found = _NOTHING
        for current, phase in zip(i, _PHASES, strict=True):
            if (current == current[0]).all():
                found |= phase
        return found

    def _sum(self, i: np.ndarray, missing: np.ndarray | None) -> Reason:
        """Currents of a wye sum to zero but for gain errors, offsets and noise.   s(iₐ+i_b+i_c) ≤ g Σ s(i) + noise

        Where they do not, a phase without any signal is the dead one; else which one is wrong is not known.
        """
        length = i.shape[1] // N_WINDOWS
        if length < 2:
            return _NOTHING
        windows = i[:, : length * N_WINDOWS].reshape(3, N_WINDOWS, length)
        clipped = np.maximum(windows.max(axis=2), -windows.min(axis=2)).max(axis=0) >= self._full_scale
        spread = 1.0 + N_SD / sqrt(2 * length)  # of a standard deviation itself
        sd = windows.std(axis=2)
        wrong = windows.sum(axis=0).std(axis=1) > WORST_GAIN * sd.sum(axis=0) + sqrt(3) * self._noise * spread
        wrong &= ~clipped
        if missing is not None:
            wrong &= ~missing[: length * N_WINDOWS].reshape(N_WINDOWS, length).any(axis=1)
        if not wrong.any():
            return _NOTHING
        dead = (sd <= self._noise * spread)[:, wrong]
        found = Reason.CURRENT_SUM if not dead.any(axis=0).all() else _NOTHING
        for phase, is_dead in zip(_PHASES, dead.any(axis=1), strict=True):
            found |= phase if is_dead else _NOTHING
        return found

    def _positions(self, i: np.ndarray, motion: dict[str, np.ndarray]) -> Reason:
        theta_u, theta_m = motion["theta_u"], motion["theta_m"]
        if theta_u.size < 2 * N_WINDOWS:
            return _NOTHING
        user, rotor = np.diff(theta_u), (np.diff(theta_m) + np.pi) % (2 * np.pi) - np.pi  # NaN beside a gap
        found = _NOTHING
        if (np.abs(user) > self._farthest / self._GR + self._play).any():
            found |= Reason.USER_POSITION
        if (np.abs(rotor) > self._farthest).any() or _jumps(rotor, self._jerk):
            found |= Reason.ROTOR_ANGLE
        of_user, of_rotor = _windows_span(user), _windows_span(rotor) / self._GR
        if ((of_user <= self._lvdt) & (of_rotor > self._play)).any():
            found |= Reason.USER_POSITION
        if ((of_rotor == 0) & (of_user > self._play)).any() or (not rotor.any() and self._commutates(i)):
            found |= Reason.ROTOR_ANGLE
        return found

    def _commutates(self, i: np.ndarray) -> bool:
        """Whether the currents turn: at a rotor at rest they keep to one line of the α-β plane, but for ripple."""
        alpha, beta = (2 * i[0] - i[1] - i[2]) / 3, (i[1] - i[2]) / sqrt(3)
        least, most = np.linalg.eigvalsh(np.cov(alpha, beta))
        return bool(least > self._h**2 + (N_SD * self._noise) ** 2 + WORST_GAIN**2 * most)


def _jumps(steps: np.ndarray, change: float) -> bool:
    """Whether a step differs by more than `change` from both beside it, and in the same direction.

    A stop or a clash in the gears changes the speed once and for all steps after it; a jump of a reading does not.
    """
    before, after = steps[1:-1] - steps[:-2], steps[1:-1] - steps[2:]
    return bool(((np.minimum(np.abs(before), np.abs(after)) > change) & (before * after > 0)).any())


def _windows_span(steps: np.ndarray) -> np.ndarray:
    """How far something goes within each of the windows, shape (N_WINDOWS,); NaN where there is a gap."""
    length = steps.size // N_WINDOWS
    path = np.cumsum(steps[: length * N_WINDOWS].reshape(N_WINDOWS, length), axis=1)
    return np.maximum(path.max(axis=1), 0.0) - np.minimum(path.min(axis=1), 0.0)
