"""How late the user position is, by two balances of the measured signals alone, without simulating anything.

A delay that turns the loop round is no small change of the record, so no finite difference points at it. But each of
two balances holds at every instant, whatever the loop does, and tells one delay (equation error):

    gap        θ_u(t) = θ_m(t - d)/GR + play + twist               from the rotor to the record
    control    i_q(t) = sat(K_w (K_p (θ_cmd - θ_u(t - d)) - ω_m))  from the record to the controller

A position late before the recorder's tap shows in the first alone, one late behind it in the second alone. Where the
record alone is late, it is so in the first, and in the second the controller is early by as much.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ema.core.records import Array
from ema.models.actuator import Actuator

from .features import Signals, acceleration, current_lag, dc_current, delayed, local_mean, motor_torque
from .measured import Measured

LOCAL = 20  # samples to either side in a mean: switching averages out
SETTLED = 3  # first such mean that counts: what was before the record is not known
SLOW = 10.0  # [rad/s] of the rotor, where it is about to cross the play
N_TURNS = 6  # of Gauss-Newton
FELT = 3.0  # samples; first order finds less by itself, and play or twist may look like that
MOST = 40.0  # samples that a delay may be

Balance = Callable[[Actuator, Signals, float], tuple[Array, Array]]


def see_delays(plant: Actuator, data: Measured) -> dict[str, float]:
    """By how much each effect would be late, of those that the balances show. [s]"""
    to_record, to_controller = (_late(plant, data, balance) for balance in (_gap, _control))
    of_recorder = min(max(-to_controller, 0.0), to_record)
    before_tap = to_record - of_recorder
    if of_recorder > FELT > before_tap:  # the zero of the control balance is the less sure
        of_recorder, before_tap = to_record, 0.0
    found = {"position_delay": before_tap, "controller_delay": to_controller, "recorder_delay": of_recorder}
    return {name: late / plant.control.rate for name, late in found.items() if FELT < late < MOST}


def _late(plant: Actuator, data: Measured, balance: Balance) -> float:
    """The delay with which a balance leaves least of all cycles. [samples]"""
    late = 0.0
    for _ in range(N_TURNS):
        columns, left = zip(*(balance(plant, s, late) for s in data.signals), strict=True)
        step = np.linalg.lstsq(np.concatenate(columns), np.concatenate(left), rcond=None)[0][0]
        late = float(np.clip(late + step, -MOST, MOST))
    return late


def _gap(plant: Actuator, s: Signals, late: float) -> tuple[Array, Array]:
    """Columns of a further delay, play, twist and zero (n, 4), and what the gap leaves (n,). [rad of the rotor]"""
    GR, rate = plant.transmission.GR, plant.control.rate
    theta = delayed(s.theta_m, late)
    w = local_mean(np.gradient(theta, axis=-1), LOCAL)
    twist = acceleration(theta, LOCAL, 1.0)
    of = np.stack([-w, np.tanh(w * rate / SLOW), twist, np.ones_like(w)], axis=-1)
    return of[0, SETTLED:], local_mean(GR * s.theta_u - theta, LOCAL)[0, SETTLED:]


def _control(plant: Actuator, s: Signals, late: float) -> tuple[Array, Array]:
    """Columns of a further delay and an offset (n, 2), and what the control balance leaves (n,). [A]"""
    c, limit, lag = plant.control, plant.inverter.I_max, current_lag(plant) + 0.5
    theta_u = delayed(s.theta_u, late)
    wanted = c.K_w * (c.K_p * (s.theta_cmd - theta_u) - np.gradient(s.theta_m, 1.0 / c.rate, axis=-1))
    felt = np.where(np.abs(wanted) < limit, c.K_w * c.K_p * np.gradient(theta_u, axis=-1), 0.0)
    i_q = dc_current(motor_torque(plant, s)[1], s.i)
    left = local_mean(i_q - delayed(np.clip(wanted, -limit, limit), lag), LOCAL)
    column = local_mean(delayed(felt, lag), LOCAL)
    return np.stack([column, np.ones_like(column)], axis=-1)[0, SETTLED:], left[0, SETTLED:]
