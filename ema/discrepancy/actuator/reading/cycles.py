"""Measured cycles of a three-phase actuator: checked, and grouped into motions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import uniform_filter1d

from ema.core.names import CURRENTS, FAULTS
from ema.core.records import Array, Cycle, Record, require
from ema.effects.base import T_REFERENCE
from ema.models.actuator import Actuator
from ema.models.envelope import envelope
from ema.models.turns import nearest_turn

from .checks import check_rate, check_signals
from .clipping import ranges
from .features import Signals, features, stacked
from .measured import Measured
from .resolution import resolution
from .sampling import between, positions_every
from .zeros import zero_apart

REQUIRED = ("t", *CURRENTS, "theta_m", "theta_u", "theta_cmd")
MIN_DURATION = 0.2  # [s]
AT_REST_SPEED = 0.1  # [rad/s]
START_SAMPLES = 10
HIDDEN = 2e-5  # [rad rms] noise of the rotor angle that its own motion hides
MEDIAN_OF_NORMAL = 0.6745  # of |x| where x is standard normal
AT_REST = 1e-3  # [s] at the start of a cycle, over which the position is averaged
CLEAR = 4.0  # standard deviations
STARTING = (10e-3, 7e-3, 5e-3, 3.5e-3, 2.5e-3)  # [s] at the start of a cycle
SAME_COMMAND, LOCAL = 1e-6, 5e-3  # [rad] by which commands of one motion may differ in the mean over [s]
AS_NOISE = 1.15  # times the noise that a curve through it may leave


def prepare(plant: Actuator, records: Sequence[Record]) -> Measured:
    """Check the records against the plant and prepare them; RecordError says in one line what is wrong."""
    commands: list[Array] = []
    labels, everything = [], []
    with_supply = all("u_dc" in record.channels for record in records)
    with_temperature = all("temp_w" in record.channels for record in records)
    for record in records:
        require(
            record,
            REQUIRED,
            min_samples=int(MIN_DURATION * plant.control.rate),
            varying=("theta_cmd", "theta_m", "theta_u", *CURRENTS),
        )
        for cycle in record.cycles:
            where = f"{record.name}: {cycle}"
            check_rate(where, cycle, plant)
            s = _signals(cycle, with_supply, plant.transmission.GR)
            check_signals(where, s, plant)
            labels.append(where)
            everything.append((s, cycle))
    signals = [s for s, _ in everything]
    every = positions_every(signals[0].theta_m[0])
    motion = [_motion(commands, c["theta_cmd"], resolution(c["theta_cmd"][::every]), plant) for _, c in everything]
    commands = [between(c, every, resolution(c[::every])) for c in commands]
    rest = max(1, round(AT_REST * plant.control.rate))
    user = np.array([_user_at_start(s.theta_u[0], plant.control.rate) for s in signals])
    start = np.column_stack([user[:, 0], [s.theta_m[0, 0] for s in signals]])
    holding = np.array([s.i[0, :, :rest].mean(axis=1) for s in signals])
    speed = np.array([_speed_at_start(s.theta_m[0], plant.control.rate) for s in signals])
    dT = np.array([cycle["temp_w"].mean() - T_REFERENCE if with_temperature else 0.0 for _, cycle in everything])
    return Measured(
        tuple(labels),
        commands,
        np.array(motion, dtype=np.int64),
        signals,
        [stacked(features(plant, s))[0] for s in signals],
        [envelope(s.i, plant.control.rate)[0] for s in signals],
        start,
        speed,
        user[:, 1],
        holding - holding.mean(axis=1, keepdims=True),
        dT,
        with_temperature,
        resolution(np.concatenate([cycle["theta_m"][::every] for _, cycle in everything])),
        _white_noise([s.theta_m[0] for s in signals]) if every == 1 else 0.0,
        zero_apart(plant, signals),
        every,
        np.zeros((len(labels), len(FAULTS))),
        ranges(signals, plant.sensors.adc_step),
    )


def _signals(cycle: Cycle, with_supply: bool, GR: float) -> Signals:
    theta_m = np.unwrap(cycle["theta_m"])
    theta_m += nearest_turn(cycle["theta_u"][0], theta_m[0], GR)
    return Signals(
        np.stack([cycle[name] for name in CURRENTS])[None],
        theta_m[None],
        cycle["theta_u"][None],
        cycle["theta_cmd"][None],
        cycle["u_dc"][None] if with_supply else None,
    )


def _motion(commands: list[Array], command: Array, step: float, plant: Actuator) -> int:
    """Index of the motion with this command, but for noise or the resolution it is recorded with; appended if new."""
    width = max(1, round(LOCAL * plant.control.rate))
    for index, known in enumerate(commands):
        if len(known) != len(command) or np.abs(known - command).max() > plant.sensors.lvdt_step:
            continue
        if np.abs(uniform_filter1d(known - command, width)).max() <= max(step, SAME_COMMAND):
            return index
    commands.append(command)
    return len(commands) - 1


def _speed_at_start(theta_m: Array, rate: float) -> float:
    """ω_m at the first sample; zero at rest and where motion only begins (coarse angles are taken over more samples).

    From rest the second difference is at least three times the first; what moves already has two alike.
    """
    step = resolution(theta_m) or 4.0 * _white_noise([theta_m])
    m = START_SAMPLES if step else 1
    first, second = float(theta_m[m] - theta_m[0]), float(theta_m[2 * m] - theta_m[m])
    w = (3.0 * first - second) * rate / (2.0 * m)
    moving = first * second > 0.0 and abs(first) > 0.5 * abs(second)
    return w if moving and abs(w) > max(AT_REST_SPEED, 3.0 * step * rate / m) else 0.0


def _user_at_start(theta_u: Array, rate: float) -> tuple[float, float]:
    """θ_u and ω_u at the first sample, by the longest parabola that leaves noise; at rest unless ω_u is clear of it."""
    x = theta_u[: round(STARTING[0] * rate)]
    noise = float(np.sqrt(np.mean(np.diff(x, 3) ** 2) / 20.0))  # variance of a third difference: 1 + 9 + 9 + 1
    theta = w = variance = 0.0
    for duration in STARTING:
        t = np.arange(round(duration * rate)) / rate
        powers = t[:, None] ** np.arange(3)
        solution, *_ = np.linalg.lstsq(powers, x[: len(t)], rcond=None)
        theta, w, variance = (
            float(solution[0]),
            float(solution[1]),
            noise**2 * float(np.linalg.inv(powers.T @ powers)[1, 1]),
        )
        if np.sqrt(np.mean((x[: len(t)] - powers @ solution) ** 2)) < AS_NOISE * noise:
            break
    is_moving = w**2 > CLEAR**2 * variance
    return (theta, w) if is_moving else (float(x[: max(1, round(AT_REST * rate))].mean()), 0.0)


def _white_noise(channels: Sequence[Array]) -> float:
    """Rms of what is white in an angle, from fourth differences by their median; 0 where it is less than HIDDEN."""
    differences = np.concatenate([np.diff(x, 4) for x in channels])
    rms = float(np.median(np.abs(differences))) / MEDIAN_OF_NORMAL / np.sqrt(70.0)  # 70 = 1² + 4² + 6² + 4² + 1²
    step = resolution(np.concatenate(list(channels)))
    white = np.sqrt(max(rms**2 - step**2 / 12.0, 0.0))
    return float(white) if white > max(HIDDEN, step) else 0.0
