"""What was learned of columns goes back to each motion as it came from it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ema.discrepancy.actuator.fit import stacked_jacobian
from ema.discrepancy.actuator.flat import _as_columns
from ema.discrepancy.actuator.free import free
from ema.discrepancy.actuator.noise import MotionNoise
from ema.discrepancy.engine.statistic import Root


def test_motions_need_not_have_as_many_features_as_each_other():
    """A motion that is cut short has fewer windows; the cycles of both stand between each other."""
    rng = np.random.default_rng(8)
    sizes, frees = (11, 7), (free("magnet_flux.change", 0.01), free("current_gain.gain_a", 0.01))

    def noise_of(n):
        z = rng.standard_normal((5, n))
        return MotionNoise(rng.uniform(0.5, 2.0, n), Root.of(z), z, z, np.zeros(5, dtype=int))

    data = SimpleNamespace(motion=np.array([0, 1, 0, 1, 1]), dT=np.zeros(5))
    noise = SimpleNamespace(motions=[noise_of(n) for n in sizes], plant=SimpleNamespace(data=data, first=(0, 1)))
    noise.of = lambda cycle: noise.motions[int(data.motion[cycle])]
    columns = {(m, f.name): rng.standard_normal(n) for m, n in enumerate(sizes) for f in frees}
    cycles = range(len(data.motion))
    back = _as_columns(noise, frees, stacked_jacobian(noise, frees, columns, cycles), cycles)
    assert back.keys() == columns.keys()
    for of, column in columns.items():
        assert back[of] == pytest.approx(column)
