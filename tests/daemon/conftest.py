from __future__ import annotations

from collections import deque

import numpy as np
import pytest

from ema.bus import codec
from ema.bus.port import Port
from ema.core import frames as fr


class ScriptedPort(Port):
    """A bus that yields given batches, then calls `at_end`; keeps what is written."""

    def __init__(self, batches, at_end):
        super().__init__("scripted")
        self.batches = deque(batches)
        self.at_end = at_end
        self.written = []

    def read(self, timeout):
        if not self.batches:
            self.at_end()
            return fr.empty(0)
        batch = self.batches.popleft()
        if callable(batch):
            batch(self)
            return fr.empty(0)
        self.counters.n_received += batch.size
        return batch

    def write(self, frames):
        self.written.append(frames.copy())
        self.counters.n_sent += frames.size
        return frames.size

    def close(self):
        pass

    def sent(self, name):
        """What was sent of one message, decoded frame by frame."""
        message = codec.default().messages[name]
        frames = np.concatenate(self.written)
        return message.decode(frames[(frames["id"] & ~np.uint32(63 << 2)) == message.frame_id])


@pytest.fixture
def frames(fly):
    ramp = {"ramp": {"duration": "10 s", "initial": 0.01, "final": 0.06}}
    flight = fly(n_cycles=6, seed=5, actuators=[{"faults": {"k1": ramp, "k4": ramp}}])
    return np.concatenate([frames for _, frames in flight])


@pytest.fixture
def write_config(tmp_path, coarse_bundle):
    """Writes a daemon configuration, in which some keys are said otherwise."""

    def make(**other):
        import yaml

        (tmp_path / "log").mkdir(exist_ok=True)
        content = {
            "bus": {"interface": "virtual"},
            "actuators": {0: {"bundle": str(coarse_bundle.path)}},
            "log": {"directory": "log"},
            **other,
        }
        path = tmp_path / "daemon.yaml"
        path.write_text(yaml.safe_dump({key: value for key, value in content.items() if value is not None}))
        return path

    return make


@pytest.fixture
def scripted():
    return ScriptedPort
