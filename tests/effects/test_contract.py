"""What every effect must keep, whatever it is: it applies at once to a new file in ema/effects."""

from __future__ import annotations

import inspect
from functools import cache

import numpy as np
import pytest

from ema.core import config, resources
from ema.core.names import FAULTS
from ema.core.units import convert
from ema.effects import HOOKS, registry
from ema.models import hf
from ema.models.actuator import Actuator

EFFECTS = list(registry().values())


@pytest.fixture(scope="module")
def plant():
    return config.load(resources.config("actuator.yaml"), Actuator)


@pytest.fixture(scope="module")
def nominal(plant):
    return hf.simulate(plant, np.zeros(6), noise=False)


@pytest.fixture(scope="module")
def without(plant):
    """Sixteen runs without an effect, of a command so many times the plant's own."""
    return cache(lambda times: hf.simulate(plant, np.zeros((16, 6)), times * plant.command(), seeds=np.arange(16)))


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_declaration(effect):
    assert effect.parameters
    assert set(effect.mistaken_for) <= set(FAULTS)
    assert set(effect.plants) <= {"ema", "axis"}
    assert "{" not in effect.said({})
    assert set(effect.besides) <= set(effect.neutral())
    assert effect.said({}) == effect.said(effect.neutral())
    assert "{" not in effect.said({p.name: p.start for p in effect.parameters})
    assert effect.separated_by
    assert set(effect.limits) <= set(effect.neutral())
    for p in effect.parameters:
        assert p.low <= p.neutral <= p.high
        assert p.low <= p.start <= p.high
        limit = effect.limits.get(p.name)
        assert limit is None or all(map(limit.holds, (p.low, p.neutral, p.start, p.high)))
        if p.unit not in ("1", "1/turn"):
            convert(p.unit, p.unit)
    for hook, law in effect.laws.items():
        n_arguments = HOOKS[hook][1] + len(effect.parameters)
        assert len(inspect.signature(law).parameters) == n_arguments


def test_a_share_of_friction_is_told_as_a_torque_where_friction_is_known():
    """A thousand times next to no friction is 41 N m: per cent of it say nothing."""
    effect, values = registry()["stribeck"], {"excess": 1003.41, "speed": 2.0}
    assert "41.1 N m higher" in effect.said(values, 0.041)
    assert "67% higher" in effect.said({**values, "excess": 0.67})


@pytest.mark.parametrize("effect", [e for e in EFFECTS if e.multiplies_friction], ids=lambda e: e.name)
def test_what_multiplies_friction_is_a_share_of_it_by_its_first_parameter(effect):
    values = {p.name: p.start for p in effect.parameters}
    assert "%" in effect.said(values)
    assert f"{values[effect.parameters[0].name] * 0.03:.3g} N m" in effect.said(values, 0.03)


def test_only_what_is_not_neutral_is_said():
    flux = registry()["magnet_flux"]
    assert flux.said({"per_kelvin": -0.001}) == "magnet flux changed by -0.10% per kelvin above 20 °C"
    assert flux.said({"change": -0.05}) == "magnet flux changed by -5.0%"
    both = "magnet flux changed by -5.0% and by -0.10% per kelvin above 20 °C"
    assert flux.said({"change": -0.05, "per_kelvin": -0.001}) == both


def test_what_is_rounded_to_nothing_has_no_sign_but_a_plus():
    gains = registry()["recorder_gain"].said({"gain_a": -0.0002, "gain_b": 0.0002, "gain_c": -0.012})
    assert "+0.0%, +0.0%, -1.2%" in gains


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_laws_are_neutral_at_their_neutral_values(effect):
    rng = np.random.default_rng(1)
    for hook, law in effect.laws.items():
        how, n = HOOKS[hook]
        for x in rng.uniform(-3, 3, (20, n)):
            assert law(*x, *effect.neutral().values()) == pytest.approx(0.0 if how == "sum" else 1.0, abs=1e-12)


@pytest.mark.parametrize("effect", [e for e in EFFECTS if "ema" in e.plants], ids=lambda e: e.name)
def test_neutral_values_leave_the_record_as_it_is(effect, plant, nominal, monkeypatch):
    monkeypatch.setattr(hf, "_is_active", lambda z, name: np.ones(z.shape[1], bool))  # its laws take part nevertheless
    with_effect = hf.simulate(plant, np.zeros(6), noise=False, effects={effect.name: effect.neutral()})
    # rounding differs between the two kernels until switching decorrelates them: compare the envelopes' mean
    assert with_effect.envelope.mean() == pytest.approx(nominal.envelope.mean(), rel=2e-3)
    assert np.abs(with_effect.theta_u - nominal.theta_u).max() < 5e-5


@pytest.mark.parametrize("effect", [e for e in EFFECTS if "ema" in e.plants], ids=lambda e: e.name)
def test_start_values_change_the_record(effect, plant, without):
    """An effect that changes nothing cannot be found: at its start value it must be seen in some recorded channel."""
    start = {p.name: p.start for p in effect.parameters}
    commands = {"winding_resistance": 3.0, "supply_sag": 3.0, "adc_saturation": 2.0}
    times = commands.get(effect.name, 1.0)
    a, seeds = without(times), 100 + np.arange(16)
    b = hf.simulate(plant, np.zeros((16, 6)), times * plant.command(), seeds=seeds, effects={effect.name: start})

    def distance(channel):
        x, y = getattr(a, channel), getattr(b, channel)
        spread = np.sqrt(0.5 * (x.var(axis=0) + y.var(axis=0))) / 4 + 1e-12
        return np.sqrt(np.mean(((x.mean(axis=0) - y.mean(axis=0)) / spread) ** 2))

    assert max(map(distance, ("i", "envelope", "theta_m", "theta_u", "u_dc"))) > 3.0
