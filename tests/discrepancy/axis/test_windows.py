"""Records cut into windows, with what each channel's noise is."""

from __future__ import annotations

import numpy as np
import pytest

from ema.core.errors import RecordError
from ema.core.records import Cycle, Record
from ema.discrepancy.axis.reading.noise import estimate, quantum
from ema.discrepancy.axis.reading.windows import bench
from ema.models.axis_config import RotaryAxis

PLANT = RotaryAxis(J=1e-4, F_d=0.01, k_t=0.05)
T = np.arange(0.0, 1.0, 1e-3)
RNG = np.random.default_rng(5)


def record(**noise: float) -> Record:
    """Of a motor that swings, with white noise of the given rms on its channels."""
    true = {"i_q": np.cos(9.0 * T), "theta_m": 0.5 * np.sin(9.0 * T), "w_m": 4.5 * np.cos(9.0 * T)}
    noisy = {name: x + noise.get(name, 0.0) * RNG.standard_normal(len(T)) for name, x in true.items()}
    return Record((Cycle(0, {"t": T, **noisy}),))


def test_channels_stand_in_one_order_whatever_their_names_hash_to():
    """What is told of their noise had come in another order in every other process."""
    found = bench(PLANT, record(i_q=0.01, theta_m=1e-3, w_m=0.02), "one", 0.1)
    assert list(found.noise) == [found.roles.drive, *found.roles.outputs]


def test_noise_is_estimated_or_as_declared():
    made = record(i_q=0.01, theta_m=1e-3, w_m=0.02)
    found = bench(PLANT, made, "one", 0.1).noise
    assert found["w_m"].sigma == pytest.approx(0.02, rel=0.15)
    assert found["theta_m"].sigma == pytest.approx(1e-3, rel=0.15)
    declared = bench(PLANT.model_copy(update={"noise": {"w_m": 0.5}}), made, "one", 0.1).noise
    assert (declared["w_m"].sigma, declared["w_m"].declared) == (0.5, True)


def test_windows_are_about_as_long_as_asked_and_cover_no_sample_twice():
    found = bench(PLANT, record(theta_m=1e-3, w_m=0.02), "one", 0.1)
    assert not found.static
    times = np.concatenate([w.t for w in found.windows])
    assert np.all(np.diff(times) > 0.0)
    assert np.median([w.t[-1] - w.t[0] for w in found.windows]) == pytest.approx(0.1, rel=0.3)


def test_motion_is_smoothed_up_to_a_gap_and_not_across_it():
    """Over 40 samples that were lost the angle has moved on: nothing near them lies between."""
    steady = {"i_q": np.full(len(T), 0.1), "theta_m": 40.0 * T, "w_m": np.full(len(T), 40.0)}
    cut = Cycle(0, {name: np.delete(x, np.s_[600:640]) for name, x in {"t": T, **steady}.items()})
    windows = bench(PLANT, Record((cut,)), "one", 0.1).windows
    assert max(float(np.abs(w.position - 40.0 * w.t).max()) for w in windows) < 1e-9
    after = next(w for w in windows if w.t[0] == T[640])
    motion = (after.part.t, after.part.recorded, after.part.speed)
    assert [float(x[0]) for x in motion] == pytest.approx([T[640], 40.0 * T[640], 40.0])


def test_a_record_without_enough_samples_is_refused():
    short = Record((record().cycles[0].rows(0, 5),))
    with pytest.raises(RecordError, match="too short"):
        bench(PLANT, short, "one", 0.1)


def test_steps_of_a_counter_are_its_noise():
    step = 2.0 * np.pi / 4096
    counted = step * np.round(np.sin(9.0 * T) / step)
    assert quantum(counted) == pytest.approx(step)
    assert quantum(np.sin(9.0 * T)) == 0.0
    least = estimate((Cycle(0, {"t": T, "theta_m": counted}),), "theta_m", None).sigma
    assert least >= (1.0 - 1e-9) * step / np.sqrt(12.0)


def test_a_slow_signal_in_coarse_steps_is_as_noisy_as_its_steps():
    """Hardly dithered, it stands still but for a step now and then: a quantile had called that 0.041 of 0.0289."""
    true = 0.8 * np.sin(3.0 * T)
    counted = 0.1 * np.round((true + 0.015 * np.random.default_rng(2).standard_normal(len(T))) / 0.1)
    found = estimate((Cycle(0, {"t": T, "u_q": counted}),), "u_q", None).rms(np.gradient(true, T))
    assert np.sqrt(np.mean(found**2)) == pytest.approx(np.sqrt(np.mean((counted - true) ** 2)), rel=0.15)


def swinging(frequency):
    """A steady motion with a swing of 80 Hz or less, and noise: what a light rotor does beside cogging."""
    a = 2.0 / frequency
    rng = np.random.default_rng(3)
    true = {"theta_m": 20.0 * T + a * np.sin(frequency * T), "w_m": 20.0 + 2.0 * np.cos(frequency * T)}
    noise = {"theta_m": 1e-4, "w_m": 0.05}
    noisy = {name: x + noise[name] * rng.standard_normal(len(T)) for name, x in true.items()}
    plant = PLANT.model_copy(update={"noise": noise})
    (part,) = {
        w.part.number: w.part
        for w in bench(plant, Record((Cycle(0, {"t": T, "i_q": 0.1 * T, **noisy}),)), "one", 0.1).windows
    }.values()
    return part, true, noise


@pytest.mark.parametrize(("frequency", "narrower"), [(500.0, True), (20.0, False)])
def test_a_window_begins_where_the_axis_was_however_quickly_it_swings(frequency, narrower):
    """Over eleven samples a local quadratic takes half off a swing of 80 Hz: 20 deviations of the speed's noise."""
    part, true, noise = swinging(frequency)
    inside = slice(20, -20)
    off = np.std((part.speed - true["w_m"])[inside]) / noise["w_m"]
    assert off < 2.0
    assert np.std((part.position - true["theta_m"])[inside]) / noise["theta_m"] < 2.0
    assert narrower or off < 0.6  # eleven samples: a third to a half of the noise
