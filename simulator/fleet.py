"""The simulated actuators: all of them as lanes of one batch, each going on from where it stopped."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ema.effects import registry
from ema.effects.base import T_REFERENCE
from ema.models import hf
from ema.models.actuator import Actuator

from .scenario import Scenario


class CycleData(NamedTuple):
    """One test cycle of every actuator.

    `i` has shape (n_actuators, 3, n_times), the others (n_actuators, n_times) or as said.
    """

    number: int
    t_start: float  # scenario time of the cycle's t = 0 [s]
    t: np.ndarray  # (n_times,) [s]
    k: np.ndarray  # (n_actuators, 6)
    temp_w: np.ndarray  # (n_actuators,) [°C]
    theta_cmd: np.ndarray  # (n_times,) [rad]
    response: hf.Response


class Fleet:
    """Runs the actuators of a scenario, test cycle after test cycle.

    After a test motion the actuators go back to zero, and the next cycle starts from there: inside the gap and with
    the friction as the way back has left them.
    """

    def __init__(self, scenario: Scenario, plant: Actuator):
        self._scenario = scenario
        self._plant = plant
        self._effects = _by_lane([a.effects for a in scenario.actuators], plant)
        self._state = hf.cold_start(plant, len(scenario.actuators))
        self._command = plant.command()
        self._way_back = _return_command(self._command[-1], scenario.return_time, plant.control.rate)
        self._next = 0

    def next_cycle(self, k: np.ndarray) -> CycleData:
        """Simulate the next cycle with the faults `k` (n_actuators, 6) and the way back after it."""
        number, scenario = self._next, self._scenario
        t_start = number * scenario.period
        temp_w = np.array([a.temperature.at(t_start) for a in scenario.actuators])
        response = self._run(k, temp_w, self._command, part=0)
        self._state = self._run(k, temp_w, self._way_back, part=1).state
        self._next += 1
        return CycleData(number, t_start, response.t, k, temp_w, self._command, response)

    def _run(self, k: np.ndarray, temp_w: np.ndarray, command: np.ndarray, part: int) -> hf.Response:
        scenario = self._scenario
        seeds = [
            np.random.SeedSequence([scenario.seed, a.number, self._next, part]).generate_state(1, np.uint64)[0]
            for a in scenario.actuators
        ]
        response = hf.simulate(
            self._plant,
            k,
            command,
            start=self._state,
            seeds=np.array(seeds),
            effects=self._effects,
            dT=temp_w - T_REFERENCE,
            noise=scenario.noise,
        )
        self._state = response.state
        return response


def _return_command(theta: float, duration: float, rate: float) -> np.ndarray:
    """Half a cosine from `theta` to zero in two thirds of the time, then rest. [rad]"""
    t = np.arange(round(duration * rate)) / rate
    return theta * 0.5 * (1.0 + np.cos(np.pi * np.minimum(1.0, t / (duration * 2 / 3))))


def _by_lane(effects: Sequence[dict[str, dict[str, float]]], plant: Actuator) -> dict[str, dict[str, np.ndarray]]:
    """All parameters of the effects that some lane has, an array over the lanes each; the others' are the plant's."""
    merged: dict[str, dict[str, np.ndarray]] = {}
    for lane, own in enumerate(effects):
        for name, values in own.items():
            if name not in merged:
                common = {**registry()[name].neutral(), **plant.effects.get(name, {})}
                merged[name] = {parameter: np.full(len(effects), value) for parameter, value in common.items()}
            for parameter, value in values.items():
                merged[name][parameter][lane] = value
    return merged
