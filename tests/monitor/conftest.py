from __future__ import annotations

import numpy as np
import pytest

from ema.bus import codec, identifiers
from ema.monitor import Identified, Monitor, MonitorSettings, Runner, answers


class Bench:
    """A monitor on recorded frames, and the frames of one message among them."""

    def __init__(self, bundle):
        self.bundle = bundle
        self.codec = codec.default()

    def monitor(self, *actuators, **settings):
        numbers = actuators or (0,)
        return Monitor(dict.fromkeys(numbers, self.bundle), self.codec, MonitorSettings.model_validate(settings))

    def outputs(self, flight, *actuators, batch=1000, **settings):
        """Everything the monitor answers to the frames of a flight, jobs done at once."""
        return self.replay(frames_of(flight), self.monitor(*actuators, **settings), batch)

    def replay(self, frames, monitor, batch=1000):
        parts = (frames[begin : begin + batch] for begin in range(0, frames.size, batch))
        numbers = range(identifiers.N_ACTUATORS)
        return list(answers(parts, monitor, Runner(dict.fromkeys(numbers, self.bundle))))

    def linear(self, flight, *actuators, **settings):
        return linear(self.outputs(flight, *actuators, **settings))

    def places(self, frames, message, actuator=0):
        """Indices of one message's frames."""
        frame_id = identifiers.with_actuator(self.codec.messages[message].frame_id, actuator)
        return np.flatnonzero(frames["id"] == frame_id)


def frames_of(flight):
    if isinstance(flight, np.ndarray):
        return flight
    return np.concatenate([frames for _, frames in flight])


def linear(outputs):
    return [out for out in outputs if isinstance(out, Identified) and out.estimate.method == "linear"]


@pytest.fixture(scope="session")
def bench(coarse_bundle):
    return Bench(coarse_bundle)


@pytest.fixture
def growing():
    """A scenario whose faults grow from cycle to cycle."""
    ramp = {"ramp": {"duration": "10 s", "initial": 0.01, "final": 0.06}}
    return {"n_cycles": 6, "seed": 5, "actuators": [{"faults": {"k1": ramp, "k4": ramp}}]}
