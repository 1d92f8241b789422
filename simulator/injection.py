"""Faults of the moment: the scenario's, until a fault-injection frame takes over (where the scenario allows it)."""

from __future__ import annotations

import numpy as np

from ema.bus import identifiers
from ema.bus.codec import Codec
from ema.bus.protection import GOOD, Receiver

from .scenario import Scenario

MESSAGE = "SimulatorControl"


class FaultSource:
    """Fault vectors over time; the only thing in the project that listens to fault injection."""

    def __init__(self, scenario: Scenario, codec: Codec):
        self._scenario = scenario
        self._codec = codec
        numbers = [a.number for a in scenario.actuators]
        self._lanes = {number: lane for lane, number in enumerate(numbers)}
        self._receiver = Receiver(codec, [MESSAGE], numbers if scenario.allow_injection else [])
        self._ramps: dict[int, tuple[float, float, np.ndarray, np.ndarray]] = {}  # by lane: start, end, from, to
        self.n_injections = 0

    @property
    def n_refused(self) -> int:
        """Fault-injection frames that were not authentic."""
        return self._receiver.counts.n_refused

    def at(self, t: float) -> np.ndarray:
        """Fault vectors of all actuators at the time `t` [s], shape (n_actuators, 6)."""
        return np.array([self._of_lane(lane, t) for lane in range(len(self._scenario.actuators))])

    def listen(self, frames: np.ndarray, t: float) -> None:
        """Take fault-injection frames that arrived at the time `t`; all others are ignored."""
        good = frames[self._receiver.check(frames) <= GOOD]
        for message, part in self._codec.split(good):
            values = message.decode(part)
            for frame_id, k, ramp_time in zip(part["id"].tolist(), values["k"], values["ramp_time"], strict=True):
                lane = self._lanes[identifiers.actuator(frame_id)]
                self._ramps[lane] = (t, t + float(ramp_time), self._of_lane(lane, t), np.clip(k, 0.0, 1.0))
                self.n_injections += 1

    def _of_lane(self, lane: int, t: float) -> np.ndarray:
        if lane not in self._ramps:
            return np.array(self._scenario.actuators[lane].faults.at(t))
        start, end, k_from, k_to = self._ramps[lane]
        share = 1.0 if t >= end else (t - start) / (end - start)
        return k_from + share * (k_to - k_from)
