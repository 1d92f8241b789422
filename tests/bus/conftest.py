import numpy as np
import pytest

from ema.bus.codec import Codec, default


@pytest.fixture(scope="session")
def codec() -> Codec:
    return default()


@pytest.fixture
def currents(codec):
    """Makes `n` frames of phase currents of actuator 3, headers not filled."""

    def make(n: int, seed: int = 1):
        rng = np.random.default_rng(seed)
        values = {f"i_{phase}": rng.uniform(-30, 29.9, (n, 10)) for phase in "abc"}
        return codec.encode("PhaseCurrents", 3, values, t_ns=np.arange(n) * 1_000_000)

    return make
