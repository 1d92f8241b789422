from types import SimpleNamespace

import numpy as np
import pytest

from ema.core import frames as raw


def _frames(count, start_ns=1_700_000_000_000_000_000, step_ns=1_000_000, seed=0):
    """Frames with random content, one each step_ns."""
    rng = np.random.default_rng(seed)
    batch = raw.empty(count)
    batch["t_ns"] = start_ns + step_ns * np.arange(count)
    batch["id"] = rng.integers(0, 2**29, count)
    batch["flags"] = int(raw.FrameFlag.EXTENDED | raw.FrameFlag.FD)
    batch["length"] = 64
    batch["data"] = rng.integers(0, 256, (count, 64))
    return batch


def _estimate(cycle, actuator=0, method="linear", t_ns=None, k=0.1):
    return {
        "t_ns": 1_700_000_000_000_000_000 + cycle * 1_000_000_000 if t_ns is None else t_ns,
        "actuator": actuator,
        "method": method,
        "cycle": cycle,
        "status": "valid",
        "reasons": [],
        "k": np.full(6, k) / 3,
        "sd": np.full(6, 0.01),
        "p_value": 0.5,
        "residual": 0.01,
        "age": 0.01,
    }


def _envelope(cycle, actuator=0):
    t = np.linspace(0, 0.5, 30)
    return {
        "t_ns": 1_700_000_000_000_000_000 + cycle * 1_000_000_000,
        "actuator": actuator,
        "cycle": cycle,
        "t": t,
        "measured": np.where(t > 0.4, np.nan, np.sin(t)),
        "model": np.sin(t),
        "sd": np.full(30, 0.01),
    }


def _event(t_ns=1_700_000_000_000_000_000, text="something"):
    return {"t_ns": t_ns, "level": "info", "code": "test", "text": text, "actuator": None}


def _status(t_ns=1_700_000_000_000_000_000):
    return {
        "t_ns": t_ns,
        "state": "running",
        "uptime": 1.0,
        "log_state": "ok",
        "log_free": 1e9,
        "lapses": [],
        "counters": {"frames_lost": 0},
    }


@pytest.fixture(scope="session")
def make():
    """Makers of log content."""
    return SimpleNamespace(frames=_frames, estimate=_estimate, envelope=_envelope, event=_event, status=_status)
