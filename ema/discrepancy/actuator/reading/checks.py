"""Cycles that cannot be examined are refused, each in one line that says what is wrong and what would be right."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.optimize import nnls

from ema.core.errors import RecordError
from ema.core.names import CURRENTS
from ema.core.records import Array, Cycle
from ema.models.actuator import Actuator

from .features import Signals, motor_torque, reference, reference_terms

MAX_LAG = 6e-3  # [s] no sensor or loop of this plant is that late; channels are apart
MAX_CLIPPED = 0.1  # share of samples at the largest value
APART = 2.0  # times what channels leave of each other where they agree best, that they leave at a credible lag
REACH, STRIDE = 0.05, 5  # [s] how far a lag is looked for; [samples] in what steps
SMOOTH, SLOW = 20, 2.0  # samples to either side of a mean; [rad/s] where dry friction changes its side
FOLLOWING = 0.5  # correlation of channels that belong together, at least


def check_rate(where: str, cycle: Cycle, plant: Actuator) -> None:
    """A cycle must be sampled as the plant's recorder does, without gaps."""
    rate = 1.0 / cycle.period
    if abs(rate / plant.control.rate - 1.0) > 0.03:
        raise RecordError(f"{where}: is sampled at {rate:.4g} Hz, the plant's recorder at {plant.control.rate:.4g} Hz")
    longest = float(np.diff(cycle["t"]).max())
    if longest > 1.5 * cycle.period:
        raise RecordError(f"{where}: has a gap of {longest:.3g} s (samples are {cycle.period:.3g} s apart)")


def check_signals(where: str, s: Signals, plant: Actuator) -> None:
    """A cycle must move, not be clipped, and its channels must belong to this plant and to each other."""
    _check_motion(where, s, plant)
    _check_clipping(where, s, plant)
    _check_synchrony(where, s, plant)


def _check_motion(where: str, s: Signals, plant: Actuator) -> None:
    for name, x in (("theta_cmd", s.theta_cmd), ("theta_m", s.theta_m), ("theta_u", s.theta_u)):
        if np.ptp(x) == 0.0:
            raise RecordError(f"{where}: {name} is constant; a cycle in motion is needed")
    for j, name in enumerate(CURRENTS):
        if np.ptp(s.i[0, j]) <= 6.0 * plant.sensors.current_noise:
            raise RecordError(f"{where}: {name} is constant; a cycle under current is needed")
    x, y = s.theta_m[0] / plant.transmission.GR, s.theta_u[0]
    x, y = x - x.mean(), y - y.mean()
    slope = float(x @ y) / float(x @ x)
    if not 1.0 / 3.0 < slope < 3.0:  # a compliant gear may resonate, a wrong ratio is further off
        raise RecordError(
            f"{where}: θ_u moves {slope:.3g} times θ_m/GR with the plant's GR = {plant.transmission.GR:g}: "
            "a record of another plant, or a wrong unit or sign"
        )


def _check_clipping(where: str, s: Signals, plant: Actuator) -> None:
    step = plant.sensors.adc_step
    for j, name in enumerate(CURRENTS):
        x = np.abs(s.i[0, j])
        top = float(x.max())
        share = float(np.mean(x >= top - 0.5 * step))
        if top >= plant.sensors.adc_range - 1.5 * step or (share > MAX_CLIPPED and top > 0.5):
            raise RecordError(
                f"{where}: {name} is clipped at {top:.3g} A in {share:.1%} of its samples (ADC range "
                f"±{plant.sensors.adc_range:g} A); a record with less current or a wider range is needed"
            )


def _check_synchrony(where: str, s: Signals, plant: Actuator) -> None:
    """Channels that belong together must not be apart by more than any sensor or loop can be late."""
    rate = plant.control.rate
    reach, credible = int(REACH * rate), MAX_LAG * rate
    slow = ", or the current control is far slower than the plant file's"
    # What the controller asks for is made of all channels: it tells of the command once the others are known to agree.
    resisted = _resisted(plant, s)
    pairs = (
        ("θ_u", "θ_m", lambda: _lag(partial(_shifted, s.theta_u[0], s.theta_m[0]), reach, credible), ""),
        (
            "the currents",
            "θ_m",
            lambda: _lag(partial(_torque_shifted, plant, s, resisted), reach, credible),
            "",
        ),
        ("the currents", "position and command", lambda: _lag_of_loop(plant, s, reach), slow),
    )
    for late, early, find, or_else in pairs:
        lag, correlation = find()
        if abs(lag) > credible:
            if abs(lag) > reach - STRIDE:  # they agree best beyond
                raise RecordError(
                    f"{where}: {late} follow {early} at no lag up to {REACH:g} s: "
                    f"channels are not synchronised{or_else}"
                )
            side = "after" if lag > 0 else "before"
            raise RecordError(
                f"{where}: {late} come {abs(lag) / rate:.3g} s {side} {early}: channels are not synchronised{or_else}"
            )
        if correlation < FOLLOWING:
            raise RecordError(
                f"{where}: {late} do not follow {early} (correlation {correlation:.2f}): a record of another plant, "
                "a wrong sign, or channels that do not belong together"
            )


def _resisted(plant: Actuator, s: Signals) -> Array:
    """What a motor's torque is for, whatever controls it: acceleration, drag, friction, a spring at the load, (n, 4).

    Each is of unit scale, since the plant file may have others.
    """
    theta = s.theta_m[0]
    along = np.pad(theta, SMOOTH, mode="reflect", reflect_type="odd")
    w = np.gradient(np.convolve(along, np.full(2 * SMOOTH + 1, 1.0 / (2 * SMOOTH + 1)), "valid"))
    terms = np.stack([np.gradient(w), w, np.tanh(w * plant.control.rate / SLOW), theta], axis=1)
    return np.asarray(terms / terms.std(axis=0))


def _lag_of_loop(plant: Actuator, s: Signals, reach: int) -> tuple[int, float]:
    """Samples by which the torque is later than what the controller should ask for, and their correlation there.

    Where these do not agree the controller may have other gains, which turn the phase of what it asks for: then that is
    the sum of its two terms with whatever positive gains fit best.
    """
    tau, credible = motor_torque(plant, s)[0][0], MAX_LAG * plant.control.rate
    lag, correlation = _lag(partial(_shifted, tau, reference(plant, s)[0]), reach, credible)
    if abs(lag) <= credible and correlation >= FOLLOWING:
        return lag, correlation
    terms = reference_terms(plant, s)[:, 0]
    other = _lag(partial(_shifted, tau, (terms / terms.std(axis=1, keepdims=True)).T), reach, credible)
    return max((lag, correlation), other, key=lambda found: found[1])


def _lag(shifted: Callable[[int], tuple[Array, Array]], reach: int, credible: float) -> tuple[int, float]:
    """Samples by which x is later than y where they agree best, and their correlation there.

    `shifted` gives what of x is so many samples later, and the y beside it. A credible lag is taken where they agree
    hardly worse: slow motion says little about lags. Of several y, shape (n_times, n), the sum with positive weights
    that fits best is taken.
    """
    best, near = (0, -1.0), (0, -1.0)
    for lag in range(-reach, reach + 1, STRIDE):
        a, b = shifted(lag)
        r = _correlation(a - a.mean(), b - b.mean(axis=0))
        best = (lag, r) if r > best[1] + 1e-6 else best
        near = (lag, r) if r > near[1] + 1e-6 and abs(lag) <= credible else near
    return near if near[1] >= FOLLOWING and 1.0 - near[1] ** 2 < APART * (1.0 - best[1] ** 2) else best


def _correlation(x: Array, y: Array) -> float:
    if y.ndim > 1:
        y = y @ nnls(y.T @ y, y.T @ x)[0]
    scale = float(np.sqrt((x @ x) * (y @ y)))
    return float(x @ y) / scale if scale > 0.0 else 0.0


def _shifted(x: Array, y: Array, lag: int) -> tuple[Array, Array]:
    """What of `x` is so many samples later than `y`, and the `y` beside it; time is the first axis."""
    return (x[lag:], y[: len(y) - lag]) if lag >= 0 else (x[:lag], y[-lag:])


def _torque_shifted(plant: Actuator, s: Signals, terms: Array, lag: int) -> tuple[Array, Array]:
    """The torque of currents that are so many samples later than the rotor, which commutates them, and its `terms`."""
    i, theta_m = _shifted(s.i[0].T, s.theta_m[0], lag)
    tau = motor_torque(plant, replace(s, i=i.T[None], theta_m=theta_m[None]))[0][0]
    return tau, _shifted(s.i[0].T, terms, lag)[1]
