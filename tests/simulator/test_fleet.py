import numpy as np
import pytest
from ema_simulator.fleet import Fleet
from ema_simulator.scenario import load


@pytest.fixture
def fleet(write):
    def make(text):
        scenario, plant = load(write(text))
        return Fleet(scenario, plant), plant

    return make


def test_cycles_go_on_from_where_the_last_one_stopped(fleet):
    """The second start is not the nominal one: inside the gap, and not at zero; but the motion is near its start."""
    simulated, plant = fleet("noise: false")
    k = np.zeros((1, 6))
    first, second = simulated.next_cycle(k), simulated.next_cycle(k)
    assert (first.number, second.number) == (0, 1)
    assert second.t_start == 1.0
    assert first.response.theta_m[0, 0] == 0.0
    start = second.response.theta_m[0, 0] / plant.transmission.GR
    assert 0 < abs(start) < 0.1 * plant.motion.amplitude
    assert abs(second.response.w_m[0, 0]) < 0.5


def test_an_actuator_does_not_depend_on_its_neighbours_or_place(fleet):
    k = np.zeros((3, 6))
    k[:, 2] = [0.0, 0.2, 0.1]
    together, _ = fleet("actuators: [{number: 4}, {number: 7}, {number: 9}]")
    alone, _ = fleet("actuators: [{number: 7}]")
    for _ in range(2):
        many, one = together.next_cycle(k), alone.next_cycle(k[1:2])
        assert np.abs(many.response.i[1] - one.response.i[0]).max() < 0.05


def test_effects_belong_to_their_actuator(fleet):
    text = "actuators: [{number: 0}, {number: 1, effects: {current_offset: {offset_a: 2.0}}}]"
    simulated, _ = fleet(text + "\nnoise: false")
    i = simulated.next_cycle(np.zeros((2, 6))).response.i[:, 0].mean(axis=1)
    assert i[1] - i[0] > 1.0


def test_the_same_scenario_is_the_same_flight(fleet):
    text = "seed: 5\nactuators: [{number: 1}, {number: 2}]"
    k = np.full((2, 6), 0.02)
    (one, _), (other, _) = fleet(text), fleet(text)
    for _ in range(2):
        assert np.array_equal(one.next_cycle(k).response.i, other.next_cycle(k).response.i)


def test_an_actuator_without_an_effect_of_its_own_has_the_plant_s(write, shipped_plant):
    """A weaker magnet in the plant file stays in every actuator that does not say otherwise."""
    plant = shipped_plant.model_copy(update={"effects": {"magnet_flux": {"change": -0.1}}})
    scenario, _ = load(write("actuators: [{}, {number: 1, effects: {magnet_flux: {change: 0.0}}}]\nnoise: false"))
    i = np.abs(Fleet(scenario, plant).next_cycle(np.zeros((2, 6))).response.envelope).mean(axis=1)
    nominal = np.abs(Fleet(scenario, shipped_plant).next_cycle(np.zeros((2, 6))).response.envelope).mean(axis=1)
    assert i[0] / nominal[1] == pytest.approx(1.0 / 0.9, rel=0.02)
    assert i[1] / nominal[1] == pytest.approx(1.0, rel=0.01)
