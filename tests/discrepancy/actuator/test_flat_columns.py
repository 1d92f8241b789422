"""What was learned of columns goes back to each motion as it came from it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ema.discrepancy.actuator.fitting.fit import stacked_jacobian
from ema.discrepancy.actuator.fitting.flat import N_SEEDS, _as_columns, _learn, _system
from ema.discrepancy.actuator.fitting.free import free
from ema.discrepancy.actuator.simulating.noise import MotionNoise
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


@pytest.fixture
def flat():
    """A true Jacobian (4000, 4) with two flat directions, and what is simulated from end to end of a way, twice."""
    rng = np.random.default_rng(3)
    U = np.linalg.qr(rng.standard_normal((4000, 4)))[0]
    V = np.linalg.qr(rng.standard_normal((4, 4)))[0]
    true = U * np.array([1.0, 0.7, 0.03, 0.005]) @ V.T

    def simulated(ways):
        noise = rng.standard_normal((len(ways), 2, 4000)) * np.sqrt(2.0 / N_SEEDS)
        return (ways @ true.T)[:, None] + noise

    return true, V.T, simulated


def test_a_long_way_does_not_hide_what_a_shorter_one_tells(flat):
    """Ways are as long as they are felt: of two flat directions the flatter one's is ten times as long."""
    true, V, simulated = flat
    ways = np.array([1000.0 * V[2], 10_000.0 * V[3]])
    rough = true + 0.01 * np.random.default_rng(4).standard_normal(true.shape)
    J = _system(_learn(rough, ways, simulated(ways), N_SEEDS), np.zeros((2, 4000))).J
    for v in V[2:]:
        assert np.linalg.norm(J @ v) == pytest.approx(np.linalg.norm(true @ v), rel=0.2)


def test_noise_of_a_short_way_is_no_response(flat):
    """At a bound ways are short, and what is simulated along them is longer by noise than by response."""
    true, V, simulated = flat
    ways = np.array([600.0 * V[2], 2_000.0 * V[3]])
    probed = _learn(true, ways, simulated(ways), N_SEEDS)
    said = _system(probed, np.zeros((2, 4000))).J
    assert np.linalg.norm(probed.J @ V[3]) > 2.0 * np.linalg.norm(true @ V[3])
    assert np.linalg.norm(said @ V[3]) < 1.5 * np.linalg.norm(true @ V[3])
    assert said @ V[:2].T == pytest.approx(true @ V[:2].T, abs=1e-3)
