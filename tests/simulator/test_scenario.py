import math
from pathlib import Path

import pytest
from ema_simulator.profile import FaultProfile
from ema_simulator.scenario import load, override

from ema.core import resources
from ema.core.errors import ConfigError


@pytest.mark.parametrize("name", sorted(p.name for p in resources.config("x").parent.glob("scenario*.yaml")))
def test_shipped_scenarios_are_sound(name):
    scenario, plant = load(resources.config(name))
    assert scenario.period >= plant.motion.duration


@pytest.mark.parametrize(
    ("value", "at"),
    [
        (0.1, {0: 0.1, 1e9: 0.1}),
        ([[10, 0.0], [20, 0.2]], {0: 0.0, 10: 0.0, 15: 0.1, 20: 0.2, 99: 0.2}),
        ([["1 min", 0.3]], {0: 0.3, 60: 0.3}),
        ({"ramp": {"start": "10 s", "duration": "10 s", "final": 0.2}}, {0: 0.0, 15: 0.1, 99: 0.2}),
        (
            {"exponential": {"time_constant": 10, "initial": 0.01, "limit": 0.5}},
            {0: 0.01, 10: 0.01 * math.e, 1e9: 0.5},
        ),
    ],
)
def test_faults_are_functions_of_time(value, at):
    profile = FaultProfile.model_validate(value)
    assert {t: profile.at(t) for t in at} == pytest.approx(at)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("actuators: [{faults: {k3: 1.5}}]", "within 0…1"),
        ("actuators: [{faults: {k3: [[0, 0], [0, 0.1]]}}]", "times must increase"),
        ("actuators: [{faults: {k3: {ramp: {duration: 1 V, final: 0.1}}}}]", "wrong unit"),
        ("actuators: [{faults: {k3: {}}}]", "name one shape"),
        ("actuators: [{faults: {k3: 'sin(t)'}}]", "valid number"),
        ("actuators: [{faults: {k7: 0.1}}]", "faults.k7' is unknown"),
        ("actuators: [{number: 1}, {number: 1}]", "actuators: each needs a number of its own"),
        ("actuators: [{number: 64}]", "less than 64"),
        ("actuators: []", "actuators: each needs a number of its own"),
        ("period: 0.6 s", "at least 0.75 s"),
        ("disturbances: {drop: 2}", "less than or equal to 1"),
        ("actuator: nowhere.yaml", "nowhere.yaml: cannot be read"),
        ("actuators: [{effects: {gremlins: {size: 1}}}]", "effect 'gremlins' is unknown"),
        ("actuators: [{effects: {cogging: {size: 1}}}]", "effect 'cogging' has no parameter 'size'"),
        ("actuators: [{}, {number: 1, effects: {cogging: {amplitude: .nan}}}]", "actuators.1.effects.*is not finite"),
        ("actuators: [{effects: {gear_compliance: {inertia: 0}}}]", "inertia = 0 must be above 0"),
        ("actuators: [{effects: {drive_gain: {gain: 0.1}}}]", "effect 'drive_gain' is unknown; known for kind ema"),
    ],
)
def test_a_wrong_scenario_is_refused_in_one_line(write, text, said):
    with pytest.raises(ConfigError, match=said) as caught:
        load(write(text))
    assert "\n" not in str(caught.value)


def test_a_plant_that_is_missing_is_named_where_it_was_meant(tmp_path, write):
    path = write("actuator: plants/mine.yaml")
    with pytest.raises(ConfigError) as error:
        load(path)
    assert str(error.value).startswith(f"{tmp_path / 'plants/mine.yaml'}: cannot be read")


def test_the_command_line_has_the_last_word(write):
    scenario, _ = load(write("rate: 2\nn_cycles: 5\n"))
    changed = override(scenario, bus="virtual:x", rate=None, n_cycles=7)
    assert (changed.bus.interface, changed.bus.channel, changed.rate, changed.n_cycles) == ("virtual", "x", 2, 7)


def test_the_plant_may_lie_beside_the_scenario(tmp_path, write):
    text = resources.config("actuator.yaml").read_text().replace("48 V\n", "40 V\n")
    Path(tmp_path / "mine.yaml").write_text(text)
    _, plant = load(write("actuator: mine.yaml"))
    assert plant.inverter.V_dc == 40
