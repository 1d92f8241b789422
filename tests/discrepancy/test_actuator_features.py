"""The balances: what they must be, whatever the simulator."""

from __future__ import annotations

import re
from functools import cache

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.fitting.fit import residuals
from ema.discrepancy.actuator.reading import features as f
from ema.discrepancy.actuator.reading.controller import describe_function_of_error, fit_function_of_error, fit_gains
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.reading.gear import find_resonance
from ema.discrepancy.actuator.simulating.noise import Noise, judge
from ema.discrepancy.actuator.simulating.plant import EmaPlant
from ema.models import hf


def test_acceleration_and_local_mean_agree_on_a_polynomial():
    t = np.arange(1001) * 1e-4
    theta = 3.0 * t**3
    m = 10
    inside = f.acceleration(theta, m, 1e-4)
    np.testing.assert_allclose(inside, f.local_mean(18.0 * t, m), rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(f.nodes(t, m), f.local_mean(t, m), rtol=1e-12)


def test_delayed_shifts_by_a_fraction():
    x = np.arange(50.0)
    np.testing.assert_allclose(f.delayed(x, 1.59)[5:], x[5:] - 1.59)
    assert f.delayed(x, 1.59)[0] == 0.0


@pytest.mark.slow
def test_two_implementations_agree_within_noise(hidden, shipped_plant):
    """The project's model and an independent one give the same features but for switching noise."""
    n = 24
    runs = hf.simulate(shipped_plant, np.zeros((n, 6)), seeds=np.arange(n))
    command = shipped_plant.command()
    ours = f.stacked(
        f.features(
            shipped_plant,
            f.Signals(runs.i, runs.theta_m, runs.theta_u, np.broadcast_to(command, runs.theta_m.shape), runs.u_dc),
        )
    )
    flawless = hidden.Flaws()
    theirs = np.array(
        [
            prepare(shipped_plant, [Record((Cycle(0, hidden.cycle(flawless, command, hidden.rest(), seed)),))]).y[0]
            for seed in range(6)
        ]
    )
    floor = f.floors(f.features(shipped_plant, f.Signals(runs.i[:1], runs.theta_m[:1], runs.theta_u[:1],
                                                         command[None], runs.u_dc[:1])))  # fmt: skip
    sd = np.sqrt(ours.var(axis=0, ddof=1) + floor**2)
    z = (theirs.mean(axis=0) - ours.mean(axis=0)) / (sd * np.sqrt(1 / 6 + 1 / n))
    assert np.mean(z**2) < 1.5


def nothing_is_noise(plant, record: Record) -> bool:
    """Whether the nominal simulation leaves noise of a flawless actuator's record."""
    data = prepare(plant, [record])
    ema = EmaPlant(plant, data)
    noise = Noise(ema, {})
    cycles = range(data.n_cycles)
    left = residuals(ema, noise, {}, cycles, 16)
    nothing_free = [np.zeros((len(data.y[ema.first[m]]), 0)) for m in range(ema.n_motions)]
    return judge(noise, [left[c] for c in cycles], cycles, nothing_free, 1.0 / 16).is_noise


@pytest.fixture(scope="module")
def two(hidden):
    """Two cycles by the second simulator, of each seed and set of flaws once."""
    return cache(lambda seed=4, **flaws: hidden.cycles(hidden.Flaws(**flaws), 2, seed))


def prepared(plant, cycles):
    return prepare(plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(cycles)))])


def test_a_record_cut_out_of_a_longer_motion_starts_in_motion(hidden, shipped_plant):
    whole = hidden.cycle(hidden.Flaws(), hidden.sine(6e-3, 5.0, 0.36), hidden.rest(), 3)
    cut = Cycle(0, {name: x[500:3500] for name, x in whole.items()})
    assert prepare(shipped_plant, [Record((cut,))]).speed[0] > 10.0
    assert nothing_is_noise(shipped_plant, Record((cut,)))


@pytest.mark.parametrize("substeps", [50, 200])
def test_another_integration_step_is_noise(hidden, shipped_plant, substeps):
    """What a simulation's grid makes of its comparators is no effect: 2 and 0.5 µs where ours takes 1."""
    bench = hidden.BENCH._replace(substeps=substeps)
    cycle = hidden.cycle(hidden.Flaws(), hidden.sine(0.0138, 2.0, 0.4), hidden.rest(), 5, bench)
    assert nothing_is_noise(shipped_plant, Record((Cycle(0, cycle),)))


@pytest.mark.parametrize("k2", [0.0, 0.05])
def test_a_resonating_gear_is_seen_in_rotor_and_user(hidden, shipped_plant, k2):
    """With its backlash, and though the user still swings when a cycle begins."""
    flaws = hidden.Flaws(compliance=1.5e-5, user_damping=30.0, k2=k2)
    soft = hidden.cycles(flaws, 3, 1, motions=(hidden.chirp(),))
    found = find_resonance(
        shipped_plant, prepare(shipped_plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(soft)))])
    )
    assert found is not None
    assert found.compliance * found.inertia == pytest.approx(1.5e-5 * 0.6, rel=0.02)
    assert found.inertia == pytest.approx(0.6, rel=0.02)
    assert found.damping == pytest.approx(15.0 * (1.5e-5 / 0.6) ** 0.5, rel=0.15)
    assert found.k2 == pytest.approx(k2, abs=0.003)
    assert (found.drag, found.friction) == (0.0, 0.0)


def test_a_plant_without_play_may_have_a_gear_that_gives(hidden, shipped_plant):
    transmission = shipped_plant.transmission.model_copy(update={"b": 0.0})
    plant = shipped_plant.model_copy(update={"transmission": transmission})
    soft = hidden.cycles(hidden.Flaws(compliance=2e-5, user_damping=30.0), 2, 3)
    with np.errstate(all="raise"):
        found = find_resonance(plant, prepared(plant, soft))
    assert found is not None
    assert found.compliance == pytest.approx(2e-5, rel=0.03)
    assert found.k2 == 0.0


@pytest.mark.slow
def test_drag_and_friction_at_the_user_do_not_hide_its_resonance(hidden, shipped_plant):
    """What the user loses to the fixed world is no damping of the gear: asked for that alone, nothing was found."""
    flaws = hidden.Flaws(compliance=2.5e-5, user_inertia=0.15, user_damping=8.0, user_drag=10.0, user_rubbing=1.0)
    found = find_resonance(
        shipped_plant, prepared(shipped_plant, hidden.cycles(flaws, 3, 1, motions=(hidden.chirp(),)))
    )
    assert found is not None
    assert found.compliance * found.inertia == pytest.approx(2.5e-5 * 0.15, rel=0.03)
    assert found.drag / found.inertia == pytest.approx(10.0 / 0.15, rel=0.1)
    assert found.friction / found.inertia == pytest.approx(1.0 / 0.15, rel=0.1)
    assert found.k2 == pytest.approx(0.0, abs=0.003)


@pytest.mark.parametrize(
    "flaws", [{}, {"k2": 0.1}, {"load": 3.0}, {"spring": 1500.0, "holding": 0.5}, {"position_delay": 1e-3}]
)
def test_a_stiff_gear_has_no_resonance(two, shipped_plant, flaws):
    assert find_resonance(shipped_plant, prepared(shipped_plant, two(seed=1, **flaws))) is None


def test_the_control_balance_of_a_sound_actuator_is_small(two, shipped_plant):
    """Σ over phases by the sector the rotor is in, less what the controller asks for: ripple and the limit are left."""
    data = prepared(shipped_plant, two())
    for s in data.signals:
        found = f.features(shipped_plant, s)
        assert np.sqrt(np.mean(found["control"] ** 2)) < 0.1
        assert np.abs(found["current"]).max() > 0.5


@pytest.mark.parametrize("change", [-0.3, -0.1, 0.2])
def test_other_gains_of_the_controller_are_read_from_the_record(two, shipped_plant, change):
    data = prepared(shipped_plant, two(speed_gain=change))
    assert fit_gains(shipped_plant, data.signals) == pytest.approx((1.0, 1.0 + change), abs=0.03)
    control = shipped_plant.control.model_copy(update={"K_p": shipped_plant.control.K_p / (1.0 + change)})
    other = shipped_plant.model_copy(update={"control": control})
    data = prepared(other, two())
    assert fit_gains(other, data.signals) == pytest.approx((1.0 + change, 1.0), abs=0.03)


@pytest.mark.parametrize("flaws", [{}, {"viscous": 1e-4}, {"k3": 0.3}, {"position_delay": 1e-3}, {"reaction": 3e-6}])
def test_what_is_no_controller_is_not_taken_for_other_gains(two, shipped_plant, flaws):
    assert fit_gains(shipped_plant, prepared(shipped_plant, two(**flaws)).signals) is None


def rests_of_control(plant, two, flaws):
    """What the actuator without flaws, of other switching instants, leaves of the currents of one with them."""
    made, sound = (prepared(plant, cycles).signals for cycles in (two(**flaws), two(seed=9)))
    return [
        (a, (f.features(plant, a)["control"] - f.features(plant, b)["control"])[0])
        for a, b in zip(made, sound, strict=True)
    ]


@pytest.mark.parametrize("deadband", [1e-4, 2e-4])
def test_a_controller_that_ignores_small_errors_is_told_by_the_error_it_ignores(two, shipped_plant, deadband):
    found = fit_function_of_error(shipped_plant, rests_of_control(shipped_plant, two, {"deadband": deadband}))
    assert found is not None
    (sentence,) = describe_function_of_error(found)
    told = re.search(r"as if errors below (\S+) rad were ignored", sentence)
    assert told is not None
    assert float(told[1]) == pytest.approx(deadband, rel=0.05)


@pytest.mark.parametrize(
    "flaws", [{}, {"viscous": 1e-4}, {"position_delay": 1e-3}, {"speed_gain": -0.2}, {"k3": 0.3}, {"gain_a": 0.05}]
)
def test_what_is_no_law_of_the_error_is_not_taken_for_one(two, shipped_plant, flaws):
    assert fit_function_of_error(shipped_plant, rests_of_control(shipped_plant, two, flaws)) is None


@pytest.mark.parametrize(
    ("current", "told"),
    [
        (lambda e: 3e3 * (np.clip(e, -1e-3, 1e-3) - e), "as if errors were cut off at 0.001 rad"),
        (lambda e: -3e3 * np.clip(e, -1e-3, 1e-3), "as if errors below 0.001 rad were ignored"),
        (lambda e: -3e3 * np.clip(e, -3e-5, 3e-5), "as if errors below 3e-05 rad were ignored"),
        (lambda e: 2e3 * np.abs(e), None),
        (lambda e: np.sin(4e3 * e), None),
    ],
)
def test_a_law_of_the_error_is_told_in_words_where_one_number_makes_it(current, told):
    at = np.linspace(-4e-3, 4e-3, 24)
    (said,) = describe_function_of_error(
        {"at": at.tolist(), "current": current(at).tolist(), "share": 0.9, "gain": 3e3}
    )
    assert ("as if" in said) == (told is not None)
    assert told is None or told in said
