"""From a recorded cycle to a measurement at a bundle's schedule; a cycle that is not the bundle's test is refused."""

from __future__ import annotations

import numpy as np

from ema.core.errors import RecordError
from ema.core.names import CURRENTS
from ema.core.records import Cycle, Record, require
from ema.models.actuator import Actuator

from .measurement import Measurement
from .sampling import Sampler

START = ("theta_u", "theta_m")
MAX_CUT_OFF = 5e-3  # [s] by which a recorder may end early; what the envelope's low-pass makes of it is left out


def missing(record: Record) -> tuple[str, ...]:
    """Channels that would help and are not there."""
    return tuple(name for name in (*START, "theta_cmd", "u_dc") if name not in record.channels)


def measurements(record: Record, plant: Actuator, schedule: np.ndarray) -> list[Measurement | RecordError]:
    """For each cycle of the record its measurement, or why it is refused.

    Raises
    ------
    RecordError
        A current is missing or dead, or every cycle has another sampling, length, motion or supply than the plant's
        test: then why the first was refused.
    """
    require(record, ("t", *CURRENTS), varying=CURRENTS)
    sampler = Sampler(plant, schedule)
    found = [_measurement(record.name, cycle, plant, sampler) for cycle in record]
    refused = [m for m in found if isinstance(m, RecordError)]
    if len(refused) == len(found) and refused:
        raise refused[0]
    return found


def _measurement(name: str, cycle: Cycle, plant: Actuator, sampler: Sampler) -> Measurement | RecordError:
    try:
        _check(f"{name}: {cycle}", cycle, plant)
    except RecordError as refused:
        return refused
    n = min(cycle.n_samples, plant.n_samples)
    i = np.zeros((3, plant.n_samples))
    i[:, :n] = [cycle[c][:n] for c in CURRENTS]
    start = [cycle[channel][0] if all(c in cycle for c in START) else np.nan for channel in START]
    return sampler.measurement(i, np.arange(plant.n_samples) >= n, *start)


def _check(what: str, cycle: Cycle, plant: Actuator) -> None:
    n, period = min(cycle.n_samples, plant.n_samples), 1.0 / plant.control.rate
    if n < plant.n_samples - MAX_CUT_OFF * plant.control.rate:
        raise RecordError(f"{what} has {n} samples, the test of '{plant.name}' has {plant.n_samples}")
    steps = np.diff(cycle["t"][:n])
    if np.abs(steps - period).max() > 0.01 * period:
        raise RecordError(
            f"{what} is sampled every {np.median(steps):g} s (worst {steps[np.abs(steps - period).argmax()]:g} s), "
            f"the bundle needs {period:g} s"
        )
    limit = max(np.abs(cycle[c]).max() for c in CURRENTS)
    if limit > 1.01 * plant.sensors.adc_range:
        raise RecordError(f"{what}: currents reach {limit:g} A, '{plant.name}' measures ±{plant.sensors.adc_range:g} A")
    if "u_dc" in cycle and abs(np.median(cycle["u_dc"][:n]) / plant.inverter.V_dc - 1.0) > 0.3:
        u_dc = np.median(cycle["u_dc"][:n])
        raise RecordError(f"{what}: bus voltage {u_dc:g} V, '{plant.name}' has {plant.inverter.V_dc:g} V")
    if "theta_cmd" in cycle:
        off = np.abs(cycle["theta_cmd"][:n] - plant.command()[:n]).max()
        if off > 0.1 * plant.motion.amplitude:
            raise RecordError(f"{what}: theta_cmd is not the test motion of '{plant.name}' (off by up to {off:g} rad)")
