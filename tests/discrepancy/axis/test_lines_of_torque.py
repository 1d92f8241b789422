"""Torque that is locked to the angle: its orders, its size and where it lies, in a motion that is written down."""

from __future__ import annotations

import numpy as np
import on_paper
import pytest

from ema.discrepancy.axis.naming.naming import line, torque_line
from ema.discrepancy.axis.scanning.cogging import cogging_candidate
from ema.discrepancy.axis.scanning.zeros import zeros
from ema.discrepancy.axis.simulating.predictable import LONGEST_WINDOW, N_GROWTHS, predictable_time

SIZE, ORDER, PHASE = 0.01, 12, 0.7
AT = {"F_d": on_paper.F_D}
SWING_OVER = on_paper.Swing(((4.0, 2.3, 0.3), (0.6, 7.1, 1.1)))  # past upright, at π
SWING_BELOW = on_paper.Swing(((0.9, 2.3, 0.3), (0.3, 7.1, 1.1)))


def ripple(t, theta, w):
    return SIZE * np.sin(ORDER * theta + PHASE)


def falling(t, theta, w):
    return 0.02 * np.sign(w) * np.exp(-np.abs(w) / 0.5)


@pytest.fixture(scope="module")
def quiet():
    return on_paper.plant(on_paper.cycle())


@pytest.fixture(scope="module")
def rippled():
    return on_paper.plant(on_paper.cycle(ripple), on_paper.cycle(ripple, seed=2, zero=0.1))


def of_first(plant):
    return [j for j, w in enumerate(plant.windows) if w.group == plant.benches[0].name]


def test_a_line_comes_back_with_order_amplitude_and_phase(rippled):
    found = cogging_candidate(rippled, AT, of_first(rippled))
    (start,) = found.starts
    assert set(start) == {line(ORDER, "cos"), line(ORDER, "sin")}
    said = torque_line(ORDER, start[line(ORDER, "cos")], start[line(ORDER, "sin")])
    assert said["amplitude"] == pytest.approx(SIZE, rel=0.02)
    assert said["phase"] == pytest.approx(PHASE, abs=0.02)
    assert all(f.low < start[f.name] < f.high for f in found.free)


def test_two_lines_come_back_and_one_of_a_hundredth_of_the_other_does_not():
    def lines(t, theta, w):
        return ripple(t, theta, w) + 0.4 * SIZE * np.cos(30 * theta) + 0.01 * SIZE * np.cos(41 * theta)

    plant = on_paper.plant(on_paper.cycle(lines))
    (start,) = cogging_candidate(plant, AT, on_paper.everywhere(plant)).starts
    assert {name.split(":")[1].rpartition(".")[0] for name in start} == {"12", "30"}
    assert start[line(30, "cos")] == pytest.approx(0.4 * SIZE, rel=0.05)


def test_where_there_is_none_none_is_found(quiet):
    assert cogging_candidate(quiet, AT, on_paper.everywhere(quiet)) is None


def test_a_line_that_the_model_has_is_not_found_again_whatever_its_size(rippled):
    parts = {line(ORDER, "cos"): 0.5 * SIZE * np.sin(PHASE), line(ORDER, "sin"): 0.5 * SIZE * np.cos(PHASE)}
    found = cogging_candidate(rippled, AT | parts, of_first(rippled))
    assert found is None or not parts.keys() & {f.name for f in found.free}


def test_an_inertia_that_is_wrong_comes_back_beside_the_line_where_it_is_fitted():
    plant = on_paper.plant(on_paper.cycle(ripple, J=1.5 * on_paper.J), fitted=["J"])
    *_, start = cogging_candidate(plant, {**AT, "J": on_paper.J}, on_paper.everywhere(plant)).starts
    assert start["J"] == pytest.approx(1.5 * on_paper.J, rel=0.02)


def test_records_with_another_zero_of_the_angle_are_seen_by_their_line(rippled):
    (found,) = zeros(rippled).values()
    assert found.orders == (ORDER,)
    assert found.angle == pytest.approx(-0.1, abs=0.01)  # to be added


def test_records_without_a_line_have_no_zero_and_one_record_has_none(quiet):
    assert zeros(quiet) == {}
    (found,) = zeros(on_paper.plant(on_paper.cycle(), on_paper.cycle(seed=2, zero=0.1))).values()
    assert found.angle is None


def test_windows_are_as_long_as_deviations_may_grow(quiet, rippled):
    """Beside the crest of A sin nθ it grows as exp(t √(A n / J)); where friction falls by F, as exp(t F / (J ω_s))."""
    assert predictable_time(quiet, quiet.benches[0]) == LONGEST_WINDOW
    growth = np.sqrt(SIZE * ORDER / on_paper.J)
    assert predictable_time(rippled, rippled.benches[0]) == pytest.approx(N_GROWTHS / growth, rel=0.02)
    plant = on_paper.plant(on_paper.cycle(falling))
    growth = 0.02 / (on_paper.J * 0.5)
    assert predictable_time(plant, plant.benches[0]) == pytest.approx(N_GROWTHS / growth, rel=0.5)


def test_windows_are_as_short_beside_a_torque_that_the_plant_file_knows():
    """A pendulum drives away from upright: sin's steepest slope; one that the motion never brings there does not."""
    A = 0.3
    declared = {"effects": {"pendulum": {"amplitude": A, "phase": 0.0}}}
    growth = np.sqrt(A / on_paper.J)
    over = on_paper.plant(on_paper.cycle(lambda t, theta, w: A * np.sin(theta), swing=SWING_OVER), **declared)
    assert predictable_time(over, over.benches[0]) == pytest.approx(N_GROWTHS / growth, rel=0.05)
    below = on_paper.plant(on_paper.cycle(lambda t, theta, w: A * np.sin(theta), swing=SWING_BELOW), **declared)
    assert predictable_time(below, below.benches[0]) == LONGEST_WINDOW


@pytest.mark.parametrize("seed", range(3))
def test_noise_that_looks_like_falling_friction_shortens_no_window(seed):
    plant = on_paper.plant(on_paper.cycle(seed=seed, noise=400.0))
    assert predictable_time(plant, plant.benches[0]) == LONGEST_WINDOW
