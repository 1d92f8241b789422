"""Torques without a known cause, as tables: the simulated rotor feels them, and a structure becomes one."""

from __future__ import annotations

import numpy as np
import pytest

from ema.discrepancy.actuator.reading.features import Signals, features
from ema.discrepancy.actuator.reading.structure import structure
from ema.discrepancy.actuator.reading.weak import torque as weak_torque
from ema.discrepancy.actuator.telling.extension import TABLES, write_extension
from ema.effects import registry
from ema.effects.table import KNOTS, tabulated
from ema.models import hf
from ema.models.actuator import Actuator

SLOW = 4e-3  # [rad] amplitude of a slow motion over the table


def law(name, **quantities):
    """The torque of a table at one place."""
    effect = registry()[name]
    place = {"theta_m": 0.0, "w_m": 0.0, "theta_u": 0.0, "i_q": 0.0} | quantities
    return lambda values: effect.laws["tabulated_torque"](*place.values(), *{**effect.neutral(), **values}.values())


def test_between_knots_a_table_is_straight_and_beyond_its_ends_it_stays():
    table = tabulated([-2e-3, 1e-3, 4e-3], [0.01, -0.02, 0.03])
    for x, tau in [(-2e-3, 0.01), (-1e-3, 0.0), (4e-3, 0.03), (9e-3, 0.03), (-9e-3, 0.01)]:
        assert law("position_torque", theta_u=x)(table) == pytest.approx(tau, abs=1e-9)
    inner = np.linspace(-2e-3, 4e-3, len(KNOTS))
    for x in inner:
        expected = np.interp(x, [-2e-3, 1e-3, 4e-3], [0.01, -0.02, 0.03])
        assert law("position_torque", theta_u=x)(table) == pytest.approx(expected, abs=1e-9)


def sliding(plant, effects, command):
    """Mean motor torque over both directions against user position: what the rotor feels besides dry friction."""
    runs = hf.simulate(plant, np.zeros((16, 6)), command, seeds=np.arange(16), effects=effects)
    theta_u, w_m, i = (x.mean(axis=0) for x in (runs.theta_u, runs.w_m, runs.I_ref))
    return theta_u, w_m, 2.0 * plant.motor.k_e * i  # two phases conduct


def test_the_rotor_feels_a_torque_that_depends_on_position(shipped_plant):
    """A slow triangle over the travel: the motor torque differs by the table's, wherever the user is."""
    t = np.arange(10001) / shipped_plant.control.rate
    command = SLOW * 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * 2.0 * t))
    table = tabulated([-SLOW, 0.0, SLOW], [0.010, -0.015, 0.005])
    theta_u, _, with_table = sliding(shipped_plant, {"position_torque": table}, command)
    _, _, without = sliding(shipped_plant, {}, command)
    n = 50  # samples averaged: 5 ms
    mean = lambda x: x[: len(x) // n * n].reshape(-1, n).mean(axis=1)  # noqa: E731
    expected = np.interp(mean(theta_u), [-SLOW, 0.0, SLOW], [0.010, -0.015, 0.005])
    error = mean(with_table - without) - expected
    away = np.abs(mean(theta_u)) < 0.85 * SLOW  # not where it turns
    assert np.sqrt(np.mean(error[away] ** 2)) < 0.1 * np.ptp(expected)


def test_a_torque_proportional_to_speed_is_viscous_drag(shipped_plant):
    """Two effects that say the same are the same."""
    c, top = 6e-5, 300.0
    table = {"speed_torque": tabulated([-top, top], [-c * top, c * top])}
    drag = {"viscous_drag": {"coefficient": c}}
    runs = [
        hf.simulate(shipped_plant, np.zeros((32, 6)), seeds=np.arange(32) + first, effects=effects).envelope
        for first, effects in ((0, table), (100, drag), (200, {}))
    ]
    means, noise = [r.mean(axis=0) for r in runs], np.sqrt(np.mean([r.var(axis=0) for r in runs]) / 16)
    assert np.sqrt(np.mean((means[0] - means[1]) ** 2)) < 1.5 * noise
    assert np.sqrt(np.mean((means[0] - means[2]) ** 2)) > 10.0 * noise


@pytest.mark.parametrize(
    ("quantity", "places", "torque"),
    [("position", [-5e-3, 0.0, 5e-3], [0.012, -0.012, 0.006]), ("speed", [-250.0, 0.0, 250.0], [0.015, 0.0, 0.015])],
)
def test_what_the_residual_shows_of_a_table_is_that_table(shipped_plant, quantity, places, torque):
    """A torque put into the simulation, the structure of the torque balance's residual, and back to a table."""
    name, n = TABLES[quantity], 16
    hidden = {name: tabulated(places, torque)}
    runs = [
        hf.simulate(shipped_plant, np.zeros((n, 6)), seeds=np.arange(n) + first, effects=effects)
        for first, effects in ((0, hidden), (100, {}))
    ]
    command = np.broadcast_to(shipped_plant.command(), runs[0].theta_m.shape)
    signals = [Signals(r.i, r.theta_m, r.theta_u, command, None) for r in runs]
    tau = [features(shipped_plant, s)["torque"] for s in signals]
    one = Signals(*(x[:1] for x in (signals[0].i, signals[0].theta_m, signals[0].theta_u, command)), None)
    r, sd = tau[0].mean(axis=0) - tau[1].mean(axis=0), tau[1].std(axis=0) / np.sqrt(n) + 1e-5
    found = structure(
        [weak_torque(one, r, sd, shipped_plant.control.rate)], shipped_plant.control.rate, {"torque": 9.0}
    )
    effects = write_extension(found)
    assert set(effects) == {name}
    argument = {"position": "theta_u", "speed": "w_m"}[quantity]
    for x in 0.7 * np.linspace(places[0], places[-1], 7):
        told, true = (law(name, **{argument: x})(values) for values in (effects[name], hidden[name]))
        assert told == pytest.approx(true, abs=0.25 * np.ptp(torque))


STRUCTURE = {
    "functions": [
        {"of": "position", "at": [-3e-3, 0.0, 3e-3], "torque": [0.004, -0.002, 0.004], "share": 0.7},
        {"of": "rotor angle", "at": [0.0, 3.0, 6.0], "torque": [0.001, 0.0, -0.001], "share": 0.4},
        {"of": "speed", "at": [-100.0, 100.0], "torque": [0.0, 0.0], "share": 0.1},
    ],
}


def test_a_structure_becomes_the_effects_of_a_plant(shipped_plant):
    """The function that explains most of it and has an effect; the plant with it simulates."""
    effects = write_extension(STRUCTURE)
    assert set(effects) == {"position_torque"}
    assert law("position_torque", theta_u=1e-3)(effects["position_torque"]) == pytest.approx(0.0, abs=3e-4)
    plant = Actuator.model_validate(shipped_plant.model_dump() | {"effects": effects})
    assert np.isfinite(hf.simulate(plant, np.zeros(6)).envelope).all()
    assert "position, between -0.003 and 0.003 rad" in registry()["position_torque"].said(effects["position_torque"])


@pytest.mark.parametrize(
    "structure",
    [
        {},
        {"functions": []},
        {"functions": STRUCTURE["functions"][1:]},  # of the angle: a line's business; of speed: too little of it
        {"sentences": ["a torque at 83 Hz whatever the motion"], "frequencies": [{"frequency": 83.0, "share": 0.9}]},
    ],
)
def test_what_no_effect_can_say_is_no_extension(structure):
    assert write_extension(structure) == {}


def test_a_table_that_is_not_credible_is_none():
    """Beyond what a torque of no known cause may be, or of one place only."""
    big = {"of": "position", "at": [-1e-3, 1e-3], "torque": [0.0, 0.5], "share": 0.9}
    point = {"of": "position", "at": [1e-3], "torque": [0.01], "share": 0.9}
    for function in (big, point):
        assert write_extension({"functions": [function]}) == {}
