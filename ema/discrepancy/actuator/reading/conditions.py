"""Under which conditions the records were taken: white noise of the sensors, voltage of the supply.

Neither is a fault or an effect, and simulating with the plant file's would make one of it. Noise is read where only
noise is left: currents of a motor with a floating neutral add up to zero, and within three samples the user moves less
than its sensor's noise. Conditions that are the plant file's leave the plant as it is.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ema.core.records import Array
from ema.models.actuator import Actuator

from .features import Signals, local_mean, motor_torque, roughness

WITHIN = 1.1  # factor by which noise may differ from the plant file's before it is replaced: what a record tells of it
SMOOTH = 101  # samples over which a user position is taken as straight but for noise
SUPPLY_MEAN = 5e-3  # [s]
SUPPLY_TOLERANCE = 2e-3  # of the plant file's voltage
DITHER = 0.13  # of a step of the LVDT, rms; runs with less noise switch in step with each other, not with a record
SEED = 20_260_101
N_BISECTIONS = 30


def current_noise(plant: Actuator, signals: Sequence[Signals]) -> float:
    """Rms white noise of one measured phase current before its converter, from Σ i_j = 0. [A]"""
    step = plant.sensors.adc_step
    total = np.sqrt(np.mean([roughness(s.i.sum(axis=1)) ** 2 for s in signals]) / 3.0)
    quantised = all(_is_on_grid(s.i, step) for s in signals)
    return float(np.sqrt(max(total**2 - (step**2 / 12.0 if quantised else 0.0), 0.0)))


def position_noise(plant: Actuator, signals: Sequence[Signals]) -> float | None:
    """Rms white noise of the user position before its converter; None where its steps are not in the record. [rad]

    A converter coarser than the noise is no white source: the noise is found that makes the smoothed record as
    rough as the record, after the converter.
    """
    step = plant.sensors.lvdt_step
    if not all(_is_on_grid(s.theta_u, step) for s in signals):
        return None
    measured = np.sqrt(np.mean([roughness(s.theta_u) ** 2 for s in signals]))
    rng = np.random.default_rng(SEED)
    kernel = np.ones(SMOOTH) / SMOOTH
    smooth = [np.convolve(s.theta_u[0], kernel, "valid") for s in signals]
    unit = [rng.standard_normal(len(x)) for x in smooth]

    def simulated(sd: float) -> float:
        parts = [roughness(step * np.round((x + sd * e) / step)) ** 2 for x, e in zip(smooth, unit, strict=True)]
        return float(np.sqrt(np.mean(parts)))

    low, high = 0.0, 10.0 * max(float(measured), step)
    for _ in range(N_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if simulated(middle) < measured else (low, middle)
    return 0.5 * (low + high)


def supply_voltage(plant: Actuator, signals: Sequence[Signals]) -> float | None:
    """Voltage of the unloaded supply: where u_dc meets zero power, u_dc = V_dc - slope · (τ ω + R Σ i_j²).   [V]"""
    if any(s.u_dc is None for s in signals):
        return None
    rate = plant.control.rate
    m = round(SUPPLY_MEAN * rate)
    power, voltage = [], []
    for s in signals:
        tau, _ = motor_torque(plant, s)
        w_m = np.gradient(s.theta_m, 1.0 / rate, axis=-1)
        power.append(local_mean(tau * w_m + plant.motor.R * (s.i**2).sum(axis=1), m).ravel())
        voltage.append(local_mean(np.asarray(s.u_dc), m).ravel())
    P, u_dc = np.concatenate(power), np.concatenate(voltage)
    return float(np.polyfit(P, u_dc, 1)[1])


def take_recorded_conditions(plant: Actuator, signals: Sequence[Signals]) -> tuple[Actuator, list[str]]:
    """The plant under the conditions of the records where these are others, and what to tell a reader of them."""
    sensors = plant.sensors
    noise = {"current_noise": (current_noise(plant, signals), sensors.adc_step, "A", 0.0)}
    position = position_noise(plant, signals)
    if position is not None:
        noise["lvdt_noise"] = position, sensors.lvdt_step, "rad", DITHER * sensors.lvdt_step
    other, notes = {}, []
    for name, (value, step, unit, least) in noise.items():
        stated = getattr(sensors, name)
        unseen = 0.1 * step  # less than that makes no difference after the converter
        if not (stated + unseen) / WITHIN < value + unseen < (stated + unseen) * WITHIN:
            seen = value if value > unseen else 0.0
            other[name] = max(seen, least)
            notes.append(
                f"sensors.{name} is {seen:.2g} {unit} rms in the records, {stated:.2g} {unit} in the plant file"
            )
    inverter, V_dc = plant.inverter, supply_voltage(plant, signals)
    if V_dc is not None and abs(V_dc / inverter.V_dc - 1.0) > SUPPLY_TOLERANCE:
        notes.append(f"inverter.V_dc is {V_dc:.4g} V in the records, {inverter.V_dc:.4g} V in the plant file")
        inverter = inverter.model_copy(update={"V_dc": V_dc})
    return plant.model_copy(update={"sensors": sensors.model_copy(update=other), "inverter": inverter}), notes


def _is_on_grid(x: Array, step: float) -> bool:
    """Whether all values are multiples of a converter's step, within a hundredth of it."""
    off = x / step
    return bool(np.abs(off - np.round(off)).max() < 0.01)
