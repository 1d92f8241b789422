"""What noise makes of a free run: white after whitening, its variance as foretold, and a start state taken off."""

from __future__ import annotations

import numpy as np
import on_paper
import pytest

from ema.discrepancy.axis.simulating.noise_model import noise_model, position_noise, without_start
from ema.discrepancy.axis.simulating.pack import MEMORY, Pack
from ema.discrepancy.axis.simulating.whitening import Push, design, join, open_loop_variance

H = np.array([[1.0, 0.0], [0.0, 1.0]])  # angle and speed
DAMPING, N = 200.0, 3000
NOISE, PUSH = (5e-6, 0.05), 20.0  # rms of the outputs, and of the acceleration by the drive's noise


def deviating(seed, n=N, start=(0.0, 0.0)):
    """A free run's deviation under noise, simulated: time, residual (2, n)."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.5e-3, 1.5e-3, n))
    state, out = np.array(start), np.empty((2, n))
    for k, h in enumerate(np.append(np.diff(t), 0.0)):
        out[:, k] = state + NOISE * rng.standard_normal(2)
        fade, push = np.exp(-DAMPING * h), PUSH * rng.standard_normal()
        state = np.array([state[0] + (1.0 - fade) / DAMPING * state[1] + 0.5 * push * h**2, fade * state[1] + push * h])
    return t, out


def pushed(t, left=1.0):
    """By the drive's noise, of which smoothing has left a share."""
    every = np.ones(len(t))
    return Push(np.append(np.diff(t), 0.0), DAMPING, 0.0 * every, PUSH * every, left * every)


def filter_for(t, start=(0.1, 10.0), left=1.0):
    return design(H, np.outer(NOISE, np.ones(len(t))), pushed(t, left), start)


@pytest.fixture(scope="module")
def quiet():
    return on_paper.plant(on_paper.cycle())


@pytest.fixture(scope="module")
def rippled():
    return on_paper.plant(on_paper.cycle(lambda t, theta, w: 2e-3 * np.sin(12 * theta)))


@pytest.mark.parametrize("start", [(0.0, 0.0), (7e-3, -0.6)])
def test_innovations_are_white_and_of_size_one_wherever_it_starts(start):
    t, residual = deviating(1, start=start)
    white = filter_for(t).whiten(residual)
    assert np.mean(white**2, axis=1) == pytest.approx([1.0, 1.0], abs=0.1)
    for row in white:
        assert abs(np.mean(row[1:] * row[:-1])) < 4.0 / np.sqrt(N)
    assert abs(np.mean(white[0] * white[1])) < 4.0 / np.sqrt(N)
    raw = residual[0] / residual[0].std()
    assert np.mean(raw[1:] * raw[:-1]) > 0.9  # it was not white before


def test_what_a_missing_torque_makes_is_no_innovation():
    t, residual = deviating(1)
    pushed = residual + np.stack([0.2 * (t - t[0]), np.full(N, 0.2)])
    assert np.mean(filter_for(t).whiten(pushed) ** 2) > 1.5


def slow_noise(seed, n, left):
    """As `deviating`, of a drive whose noise has been smoothed to a share of its variance."""
    rng = np.random.default_rng(seed)
    t, persists = 1e-3 * np.arange(n), (1.0 - left) / (1.0 + left)
    state, out, push = np.zeros(2), np.empty((2, n)), np.sqrt(left) * rng.standard_normal()
    fade = np.exp(-DAMPING * 1e-3)
    for k in range(n):
        out[:, k] = state + NOISE * rng.standard_normal(2)
        by = PUSH * push
        state = np.array([state[0] + (1.0 - fade) / DAMPING * state[1] + 0.5e-6 * by, fade * state[1] + 1e-3 * by])
        push = persists * push + np.sqrt(left * (1.0 - persists**2)) * rng.standard_normal()
    return t, out


def test_what_smoothing_leaves_of_the_drives_noise_is_whitened_as_slow():
    t, residual = slow_noise(3, N, 0.05)
    white = filter_for(t, left=0.05).whiten(residual)
    assert np.mean(white**2, axis=1) == pytest.approx([1.0, 1.0], abs=0.1)
    for row in white:
        assert abs(np.mean(row[1:] * row[:-1])) < 4.0 / np.sqrt(N)
    as_fast = filter_for(t).whiten(residual)
    assert np.mean(as_fast**2) < 0.8  # of noise that is thought to be all there


def test_slow_noise_makes_free_runs_deviate_as_foretold():
    n = 60
    ends = [slow_noise(seed, n, 0.1)[1][:, -1] for seed in range(1500)]
    t = 1e-3 * np.arange(n)
    out = open_loop_variance(H, np.outer(NOISE, np.ones(n)), pushed(t, 0.1), np.zeros((2, 2)))
    assert np.var(ends, axis=0) == pytest.approx(out[:, -1], rel=0.12)


def test_windows_whitened_together_are_as_each_alone():
    runs = [deviating(seed, 200, (0.3, 2.0)) for seed in (1, 2)]
    alone = [filter_for(t).whiten(residual) for t, residual in runs]
    together = join([filter_for(t) for t, _ in runs]).whiten(np.concatenate([r for _, r in runs], axis=1))
    assert together == pytest.approx(np.concatenate(alone, axis=1))


def test_the_variance_of_free_runs_is_foretold():
    n, start = 60, (1e-5, 0.3)
    t, _ = deviating(0, n)
    rng, ends = np.random.default_rng(5), []
    for _ in range(3000):
        state = start * rng.standard_normal(2)
        for h in np.diff(t):
            fade, push = np.exp(-DAMPING * h), PUSH * rng.standard_normal()
            state = np.array(
                [state[0] + (1.0 - fade) / DAMPING * state[1] + 0.5 * push * h**2, fade * state[1] + push * h]
            )
        ends.append(state + NOISE * rng.standard_normal(2))
    out = open_loop_variance(H, np.outer(NOISE, np.ones(n)), pushed(t), np.diag(np.square(start)))
    assert np.var(ends, axis=0) == pytest.approx(out[:, -1], rel=0.1)


def test_of_the_right_model_a_record_leaves_white_noise_of_size_one(quiet, rippled):
    (right,) = quiet.residuals([{"F_d": on_paper.F_D}], on_paper.everywhere(quiet))
    every = np.concatenate(right, axis=1)
    assert np.mean(every**2) == pytest.approx(1.0, abs=0.15)
    assert abs(np.mean(every[:, 1:] * every[:, :-1])) < 0.1
    (wrong,) = rippled.residuals([{"F_d": on_paper.F_D}], on_paper.everywhere(rippled))
    assert np.mean(np.concatenate(wrong, axis=1) ** 2) > 1.5


def test_noise_of_the_drive_accelerates_and_where_it_turns_round_more_is_unsure(quiet):
    w = next(w for w in quiet.windows if np.ptp(np.sign(w.speed)) == 0.0)
    m = noise_model(quiet.plant, quiet.benches[0], w, turning=True)
    sigma = quiet.benches[0].noise["i_q"].sigma
    assert np.median(m.push.drive) == pytest.approx(on_paper.K_T * sigma / on_paper.J, rel=0.01)
    assert m.push.damping == pytest.approx(on_paper.C / on_paper.J)
    assert [f.tolist() for f in m.H] == [[1.0, 0.0], [0.0, 1.0]]
    assert position_noise(quiet.benches[0], w) == pytest.approx(on_paper.NOISE["theta_m"], rel=0.3)


def test_a_start_that_is_off_is_no_fault_of_the_simulation(quiet):
    b = quiet.benches[0]
    w = next(w for w in quiet.windows if np.ptp(np.sign(w.speed)) == 0.0)
    (r,) = quiet.free_run({"F_d": on_paper.F_D}, [quiet.windows.index(w)])
    left, _ = without_start(quiet.plant, b, w, r)
    d = on_paper.C / on_paper.J
    fade = np.exp(-d * (w.t - w.t[0]))
    elsewhere = np.stack([0.02 + 0.3 * (1.0 - fade) / d, 0.3 * fade])
    again, _ = without_start(quiet.plant, b, w, r + elsewhere)
    assert again == pytest.approx(left, abs=1e-9)


def test_windows_of_a_record_lie_one_after_the_other_and_come_apart_again(quiet):
    windows = list(quiet.windows)
    pack = Pack(quiet.benches[0], list(range(len(windows))), windows, [])
    parts = pack.split(pack.outputs)
    assert all((parts[j] == w.outputs).all() for j, w in enumerate(windows))
    assert pack.filter is None
    bare = pack.led_in(0.0)
    assert (pack.drive_by(quiet.model({}), bare, "straight")[bare.own] == pack.drive).all()
    for by in ({"clock_skew.currents": 1e-3}, {"clock_skew.late": -3e-4}, {"drive_lag.time": 1e-3}):
        late = pack.drive_by(quiet.model(by), bare, "straight")
        assert late.shape == bare.drive.shape
        assert (late != bare.drive).any()
    assert set(pack.slide) <= {-1.0, 0.0, 1.0}


def test_the_motion_before_a_window_is_followed_once_and_no_further_back_than_it_is_remembered(quiet):
    windows = list(quiet.windows)
    offsets, t, *_, follows = Pack(quiet.benches[0], list(range(len(windows))), windows, []).history()
    assert not follows[0]
    assert follows[1:].all()
    assert [t[b - 1] for b in offsets[1:]] == [w.t[0] for w in windows]
    assert [t[a] for a in offsets[1:-1]] == [w.t[0] for w in windows[:-1]]  # from where the last one ended
    apart = [windows[0], windows[-1]]
    offsets, t, *_, follows = Pack(quiet.benches[0], [0, len(windows) - 1], apart, []).history()
    assert follows.tolist() == [False, False]
    assert t[offsets[1] : offsets[2]].min() == pytest.approx(windows[-1].t[0] - MEMORY, abs=2e-3)


def test_the_motion_before_a_window_is_of_the_same_moment_where_its_position_is_late(quiet):
    windows = list(quiet.windows)
    late = 2.6e-3
    offsets, t, theta, *_ = Pack(quiet.benches[0], list(range(len(windows))), windows, []).history(late)
    own = [(t[b - 1], theta[b - 1]) for b in offsets[1:]]
    there = [(w.t[0] + late, np.interp(w.t[0] + late, w.part.t, w.part.recorded)) for w in windows]
    assert np.array(own) == pytest.approx(np.array(there))


@pytest.mark.parametrize("of_drive", [1e-5, 5e-3], ids=["quiet drive", "drive that pushes as it is noisy"])
def test_what_a_start_known_from_noisy_samples_leaves_scatters_as_foretold(of_drive):
    """Where the drive pushes, the start takes up some of it: taken for two noises, they were half as large again."""
    plant = on_paper.plant(on_paper.cycle(), noise={"theta_m": 1e-4, "w_m": 0.05, "i_q": of_drive})
    b = plant.benches[0]
    w = next(w for w in plant.windows if np.ptp(np.sign(w.speed)) == 0.0)
    d, h, rng = on_paper.C / on_paper.J, np.diff(w.t), np.random.default_rng(3)
    sigma = np.array([b.noise[name].sigma for name in b.roles.outputs])
    push = on_paper.K_T * b.noise["i_q"].sigma / on_paper.J
    squares = []
    for _ in range(400):
        state, r = np.zeros(2), np.empty((2, w.n))
        for k in range(w.n):
            r[:, k] = state + sigma * rng.standard_normal(2)
            if k < w.n - 1:
                fade, a = np.exp(-d * h[k]), push * rng.standard_normal()
                state = np.array(
                    [state[0] + (1.0 - fade) / d * state[1] + 0.5 * a * h[k] ** 2, fade * state[1] + a * h[k]]
                )
        left, variance = without_start(plant.plant, b, w, r)
        squares.append(left**2)
    ratio = np.mean(squares, axis=0) / variance
    assert ratio[:, -1] == pytest.approx([1.0, 1.0], abs=0.2)
    assert np.abs(np.log(ratio)).max() < 0.35  # of 400 runs each, their scatter is 7 %
    assert ratio.mean() == pytest.approx(1.0, abs=0.05)
