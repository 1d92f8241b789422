"""A channel that reads what the actuator cannot do is named; a sound actuator's never is, however little it moves."""

from __future__ import annotations

import numpy as np
import pytest

from ema.bus.protection import Sender
from ema.core.status import IMPLAUSIBLE, Reason, Status
from ema.models import hf
from ema.monitor import Identified
from ema.monitor.plausibility import Plausibility

N, N_MOTION = 5001, 501
SEED = 5


def flown(plant, k, scale=1.0, codec=None):
    """Cycles as they come off the bus: currents (n, 3, 5001) and positions (n, 501), in the codec's steps."""
    k = np.atleast_2d(np.asarray(k, float))
    print("seed", SEED)
    r = hf.simulate(plant, k, scale * plant.command(), seeds=SEED + np.arange(len(k)))
    steps = {name: codec.messages["Motion"].fields[name].scale for name in ("theta_u", "theta_m")}
    theta = {"theta_u": r.theta_u[:, ::10], "theta_m": r.theta_m[:, ::10] % (2 * np.pi)}
    return r.i, {name: steps[name] * np.rint(x / steps[name]) for name, x in theta.items()}


@pytest.fixture(scope="module")
def codec():
    from ema.bus import codec

    return codec.default()


@pytest.fixture
def judge(shipped_plant):
    plausibility = Plausibility(shipped_plant)

    def reasons(i, motion, missing=None):
        return plausibility.reasons(i, np.zeros(i.shape[1], bool) if missing is None else missing, motion)

    return reasons


@pytest.fixture(scope="module")
def cycle(shipped_plant, codec):
    i, motion = flown(shipped_plant, [0.02, 0, 0.04, 0, 0, 0.01], codec=codec)
    return i[0], {name: x[0] for name, x in motion.items()}


def copies(cycle):
    i, motion = cycle
    return i.copy(), {name: x.copy() for name, x in motion.items()}


@pytest.mark.parametrize("scale", [1.0, 0.03, 0.0])
def test_a_sound_actuator_is_not_refused_however_little_it_moves_and_whatever_its_faults(
    shipped_plant, codec, judge, scale
):
    rng = np.random.default_rng(SEED)
    k = np.vstack([np.zeros((4, 6)), rng.uniform(0, 0.3, (8, 6)), np.eye(6)])
    currents, motion = flown(shipped_plant, k, scale, codec)
    for n, i in enumerate(currents):
        assert judge(i, {name: x[n] for name, x in motion.items()}) == Reason(0), k[n]


def gains(i, motion):
    i *= np.array([1.09, 0.91, 1.0])[:, None]


def offsets(i, motion):
    i += np.array([0.9, -0.2, 0.5])[:, None]


def resolver_error(i, motion):
    theta = motion["theta_m"].copy()
    motion["theta_m"][:] = (theta + 0.1 * np.cos(theta) + 0.1 * np.sin(2 * theta)) % (2 * np.pi)


@pytest.mark.parametrize("effect", [gains, offsets, resolver_error])
def test_what_is_an_effect_of_the_library_is_no_dead_sensor(cycle, judge, effect):
    i, motion = copies(cycle)
    effect(i, motion)
    assert judge(i, motion) == Reason(0)


def test_a_plant_without_noise_may_rest(shipped_plant, codec):
    sensors = shipped_plant.sensors.model_copy(update={"current_noise": 0.0, "lvdt_noise": 0.0})
    quiet = shipped_plant.model_copy(update={"sensors": sensors})
    i, motion = np.zeros((3, N)), {"theta_u": np.zeros(N_MOTION), "theta_m": np.ones(N_MOTION)}
    assert Plausibility(quiet).reasons(i, np.zeros(N, bool), motion) == Reason(0)


@pytest.mark.parametrize("value", [0.0, 1.7, -29.9])
@pytest.mark.parametrize(("phase", "reason"), list(enumerate((Reason.CURRENT_A, Reason.CURRENT_B, Reason.CURRENT_C))))
def test_a_constant_current_is_named(cycle, judge, phase, reason, value):
    i, motion = copies(cycle)
    i[phase] = value
    assert judge(i, motion) & IMPLAUSIBLE == reason


def test_a_sensor_that_reads_its_own_noise_alone_is_named(cycle, judge, shipped_plant):
    i, motion = copies(cycle)
    i[1] = 0.3 + shipped_plant.sensors.current_noise * np.random.default_rng(SEED).standard_normal(N)
    assert judge(i, motion) == Reason.CURRENT_B


@pytest.mark.parametrize("died", [500, 2500, 4400])
def test_a_sensor_that_dies_within_the_cycle_is_refused(cycle, judge, died):
    i, motion = copies(cycle)
    i[2, died:] = i[2, died]
    assert judge(i, motion) & (Reason.CURRENT_C | Reason.CURRENT_SUM)


@pytest.mark.parametrize("gain", [0.5, -1.0, 2.0])
def test_currents_that_do_not_sum_to_zero(cycle, judge, gain):
    i, motion = copies(cycle)
    i[0] *= gain
    assert judge(i, motion) == Reason.CURRENT_SUM


def test_all_dead_at_once(cycle, judge):
    i, motion = copies(cycle)
    i[:] = 0.0
    assert judge(i, motion) == Reason.CURRENT_A | Reason.CURRENT_B | Reason.CURRENT_C


@pytest.mark.parametrize("since", [0, 300])
@pytest.mark.parametrize(("channel", "reason"), [("theta_u", Reason.USER_POSITION), ("theta_m", Reason.ROTOR_ANGLE)])
def test_a_frozen_position_is_named(cycle, judge, channel, reason, since):
    i, motion = copies(cycle)
    motion[channel][since:] = motion[channel][since]
    assert judge(i, motion) == reason


def test_both_positions_frozen_while_the_currents_turn(cycle, judge):
    i, motion = copies(cycle)
    for channel in motion.values():
        channel[:] = channel[0]
    assert judge(i, motion) == Reason.ROTOR_ANGLE


@pytest.mark.parametrize("jump", [0.3, -0.3, 2.0])
def test_an_angle_that_jumps_is_named(cycle, judge, jump):
    i, motion = copies(cycle)
    motion["theta_m"][200:] += jump
    motion["theta_m"] %= 2 * np.pi
    assert judge(i, motion) == Reason.ROTOR_ANGLE


def test_a_user_position_that_jumps_is_named(cycle, judge):
    i, motion = copies(cycle)
    motion["theta_u"][200:] += 0.01
    assert judge(i, motion) == Reason.USER_POSITION


def test_currents_at_the_end_of_their_converters_range_need_not_sum_to_zero(cycle, judge):
    i, motion = copies(cycle)
    i[0] = np.clip(20 * i[0], -30, 29.999)  # one phase has a range too small, the others have not
    i[1:] *= 20
    assert judge(i, motion) == Reason(0)


@pytest.mark.parametrize("last", [0.0, 0.2])
def test_a_stop_is_no_jump(cycle, judge, last):
    """Against its end stop a rotor loses all its speed in a moment, or in two, and keeps none."""
    i, motion = copies(cycle)
    steps = np.full(N_MOTION - 1, 0.4)
    steps[250], steps[251:] = last, 0.0
    motion["theta_m"] = np.concatenate([[0.0], np.cumsum(steps)]) % (2 * np.pi)
    motion["theta_u"] = np.concatenate([[0.0], np.cumsum(steps)]) / 500
    assert judge(i, motion) == Reason(0)


def test_gaps_are_no_evidence(cycle, judge):
    i, motion = copies(cycle)
    missing = np.zeros(N, bool)
    missing[1000:2500] = True
    i[:, missing] = 0.0
    for channel in motion.values():
        channel[100:250] = np.nan
    assert judge(i, motion, missing) == Reason(0)
    assert judge(0 * i, {name: np.full(N_MOTION, np.nan) for name in motion}, ~np.zeros(N, bool)) == Reason(0)


def test_through_the_monitor_a_dead_sensor_is_invalid_without_numbers_and_lf2_is_not_asked(bench, fly):
    frames = np.concatenate([frames for _, frames in fly(n_cycles=3, seed=SEED)])
    dead = bench.places(frames, "PhaseCurrents")
    field = bench.codec.messages["PhaseCurrents"].fields["i_b"]
    own = np.ascontiguousarray(frames[dead])
    field.view(own)[500:1002] = 0  # of the second cycle on
    frames[dead] = Sender().protect(own)
    outputs = [o for o in bench.outputs(frames, slower={"lf2": {"every": 0.01}}) if isinstance(o, Identified)]
    linear = [o.estimate for o in outputs if o.estimate.method == "linear"]
    assert [e.status for e in linear] == [Status.VALID, Status.INVALID, Status.VALID]
    assert linear[1].reasons == Reason.CURRENT_B
    assert np.isnan(linear[1].k).all()
    assert [o.cycle for o in outputs if o.estimate.method == "lf2"] == [0, 2]
