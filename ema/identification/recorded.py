"""From a recorded cycle to a measurement at a bundle's schedule; a cycle that is not the bundle's is refused."""

from __future__ import annotations

import numpy as np

from ema.core.errors import RecordError
from ema.core.records import Cycle, Record, require
from ema.models.actuator import Actuator
from ema.models.envelope import envelope

from .measurement import Measurement

CURRENTS = ("i_a", "i_b", "i_c")
START = ("theta_u", "theta_m")


def missing(record: Record) -> tuple[str, ...]:
    """Channels that would help and are not there."""
    return tuple(name for name in (*START, "theta_cmd", "u_dc") if name not in record.channels)


def measurements(record: Record, plant: Actuator, schedule: np.ndarray) -> list[Measurement]:
    """One measurement for each cycle of the record.

    Raises
    ------
    RecordError
        A current is missing or dead, or a cycle has another sampling, length, motion or supply than the plant's test.
    """
    require(record, ("t", *CURRENTS), varying=CURRENTS)
    return [_measurement(record.name, cycle, plant, schedule) for cycle in record]


def _measurement(name: str, cycle: Cycle, plant: Actuator, schedule: np.ndarray) -> Measurement:
    _check(f"{name}: {cycle}", cycle, plant)
    i = np.array([cycle[c][: plant.n_samples] for c in CURRENTS])
    start = None
    if all(channel in cycle for channel in START):
        start = np.array([cycle["theta_u"][0], cycle["theta_m"][0] / plant.transmission.GR])
    return Measurement.complete(envelope(i, plant.control.rate)[schedule], start)


def _check(what: str, cycle: Cycle, plant: Actuator) -> None:
    n, period = plant.n_samples, 1.0 / plant.control.rate
    if cycle.n_samples < n:
        raise RecordError(f"{what} has {cycle.n_samples} samples, the test of '{plant.name}' has {n}")
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
        off = np.abs(cycle["theta_cmd"][:n] - plant.command()).max()
        if off > 0.1 * plant.motion.amplitude:
            raise RecordError(f"{what}: theta_cmd is not the test motion of '{plant.name}' (off by up to {off:g} rad)")
