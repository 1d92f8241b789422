"""The HF model against physics: laws, balances and limits, not stored curves."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from ema.core import config, resources
from ema.effects import registry
from ema.effects.inverter import leg_voltage
from ema.models import hf
from ema.models.actuator import Actuator
from ema.models.envelope import envelope
from ema.models.layout import STATE

PLANT = config.load(resources.config("actuator.yaml"), Actuator)
SEEDS = np.arange(32)


def varied(**sections) -> Actuator:
    data = PLANT.model_dump()
    for section, values in sections.items():
        data[section].update(values)
    return Actuator.model_validate(data)


def runs(k=(0, 0, 0, 0, 0, 0), plant=PLANT, command=None, **kwargs) -> hf.Response:
    return hf.simulate(plant, np.tile(k, (len(SEEDS), 1)), command, seeds=SEEDS, n_threads=2, **kwargs)


def rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(x))))


@pytest.fixture(scope="module")
def nominal() -> hf.Response:
    return runs()


@pytest.fixture(scope="module")
def switching_noise(nominal) -> float:
    return rms(nominal.envelope - nominal.envelope.mean(axis=0))


def test_the_controller_keeps_its_law(nominal):
    """Away from the limit:   θ_cmd - θ_u = (ω_m + I_ref / K_w) / K_p   at every sample."""
    c = PLANT.control
    error = PLANT.command() - nominal.theta_u
    assert np.allclose(error, (nominal.w_m + nominal.I_ref / c.K_w) / c.K_p, atol=1e-9)
    assert np.abs(nominal.I_ref).max() < PLANT.inverter.I_max
    assert np.ptp(nominal.theta_u) > 1.5 * PLANT.motion.amplitude


def test_halving_the_step_changes_less_than_switching_noise(nominal, switching_noise):
    finer = runs(dt=0.5e-6)
    assert rms(finer.envelope.mean(axis=0) - nominal.envelope.mean(axis=0)) < switching_noise


@pytest.mark.parametrize("k", [(0, 0, 0, 0, 0, 0), (0.2, 0.1, 0.3, 0, 0.1, 0.2)])
def test_energy_balance_closes(k):
    """Electrical in = copper + magnetic + shaft;   shaft = friction and viscous + kinetic, each to 1 %."""
    r = hf.simulate(PLANT, np.array(k), audited=True)
    E = {name: float(value[0]) for name, value in r.energy.items()}
    state = dict(zip(STATE, r.state[0], strict=True))
    N = 1 - np.array(k[2:5])
    magnetic = 0.5 * PLANT.motor.L * sum(n**2 * state[f"i_{j}"] ** 2 for n, j in zip(N, "abc", strict=True))
    kinetic = 0.5 * PLANT.motor.J_m * state["w_m"] ** 2
    assert E["E_electric"] == pytest.approx(E["E_copper"] + E["E_shaft"] + magnetic, rel=0.01)
    lost = E["E_friction"] + E["E_user"]  # dry friction; E_user holds the viscous torque
    assert E["E_shaft"] == pytest.approx(lost + kinetic, rel=0.01)
    assert E["E_friction"] > 0
    assert E["E_copper"] > 0


def test_envelope_is_the_dc_equivalent_current(nominal):
    """In six-step the envelope is |I_ref| where the current follows its reference (away from reversals)."""
    steady = np.abs(nominal.I_ref).mean(axis=0) > 2.0
    ratio = nominal.envelope.mean(axis=0)[steady] / np.abs(nominal.I_ref).mean(axis=0)[steady]
    assert np.median(ratio) == pytest.approx(1.0, abs=0.05)


def test_friction_raises_current_in_slow_motion(nominal):
    """k1: F_d × (1 + 3 k1). In slow motion τ = F_d, so the envelope's rise is 3 k1 F_d / 2 k_e."""
    slow = 2e-3 * np.sin(2 * np.pi * 2.0 * PLANT.time())
    moving = slice(2800, 3600)  # half a turn after reversal, away from breakaway
    rise = runs((0.2, 0, 0, 0, 0, 0), command=slow).envelope - runs(command=slow).envelope
    expected = 3 * 0.2 * PLANT.transmission.F_d / (2 * PLANT.motor.k_e)
    assert rise[:, moving].mean() == pytest.approx(expected, rel=0.15)


def test_backlash_opens_the_gap_between_motor_and_user():
    """k2: b × (1 + 100 k2). The user lags the gear output by at most b, on both sides."""
    for k2 in (0.0, 0.2):
        r = runs((0, k2, 0, 0, 0, 0))
        b = PLANT.transmission.b * (1 + 100 * k2)
        gap = r.theta_m / PLANT.transmission.GR - r.theta_u
        resolution = PLANT.sensors.lvdt_step + 5 * PLANT.sensors.lvdt_noise
        assert gap.max() == pytest.approx(b, abs=resolution)
        assert gap.min() == pytest.approx(-b, abs=resolution)


ANGLES = np.linspace(0, 2 * np.pi, 24, endpoint=False) + 0.03


def shaft_torque(k) -> np.ndarray:
    """Torque at 5 A and standstill at each of `ANGLES`, from the acceleration of a rotor without friction. [N m]"""
    I = 5.0
    free = varied(inverter={"h": 0.02, "I_max": I}, transmission={"F_s": 0.0, "F_d": 0.0, "b": 0.0}, motor={"C": 0.0})
    start = hf.start_at(free, ANGLES / free.transmission.GR, ANGLES)
    far = np.full(16, 0.3)
    r = hf.simulate(free, np.tile(k, (len(ANGLES), 1)), far, start=start, dt=0.25e-6, noise=False)
    return free.motor.J_m * (r.w_m[:, 15] - r.w_m[:, 5]) / (r.t[15] - r.t[5])


def flat_tops() -> tuple[np.ndarray, np.ndarray]:
    """Sign of each phase's flat top (3, n) at `ANGLES`, 0 where it idles; and where no phase is near a corner."""
    x = PLANT.motor.p * ANGLES - 2 * np.pi / 3 * np.arange(3)[:, None]
    clear = np.all(np.abs(np.abs(np.sin(x)) - 0.5) > 0.06, axis=0)
    return np.where(np.abs(np.sin(x)) > 0.5, np.sign(np.sin(x)), 0.0), clear


@pytest.mark.parametrize("torque", [3.0, -3.0])
def test_a_load_moves_a_user_that_friction_does_not_hold_to_its_side_of_the_gap(torque):
    gaps = []
    for plant in (PLANT, varied(transmission={"F_u": 4.0}), varied(transmission={"F_u": 2.0})):
        r = hf.simulate(plant, np.zeros(6), effects={"constant_load": {"torque": torque}}, noise=False)
        gaps.append((r.theta_m / plant.transmission.GR - r.theta_u)[0, 500:])
    *held, pressed = gaps
    assert np.array_equal(*held)
    assert np.ptp(held[0]) > 2.0 * PLANT.transmission.b
    side = np.copysign(PLANT.transmission.b, torque)
    assert np.abs(pressed - side).max() < 0.51 * PLANT.sensors.lvdt_step


def test_torque_is_two_k_e_I_at_every_angle():
    _, clear = flat_tops()
    assert np.allclose(shaft_torque(np.zeros(6))[clear], 2 * PLANT.motor.k_e * 5.0, rtol=0.01)


@pytest.mark.parametrize("phase", [0, 1, 2])
def test_a_short_weakens_the_torque_where_its_phase_conducts(phase):
    """k3-5: κ_j ∝ 1 - k.   τ = (2 - k) k_e I with that phase on its flat top, 2 k_e I where it idles."""
    k = np.zeros(6)
    k[2 + phase] = 0.2
    tops, clear = flat_tops()
    expected = PLANT.motor.k_e * 5.0 * (2 - 0.2 * np.abs(tops[phase]))
    assert np.allclose(shaft_torque(k)[clear], expected[clear], rtol=0.015)


def test_a_short_lowers_resistance_and_inductance():
    """R_j = R N_j, L_j = L N_j²: at standstill the supply needs less power, and the current rises faster."""
    from ema.models.layout import row

    z = hf.parameters(PLANT, np.array([[0, 0, 0.2, 0, 0.5, 0]]), {})[:, 0]
    assert [z[row(f"R_{j}")] for j in "abc"] == pytest.approx(PLANT.motor.R * np.array([0.8, 1, 0.5]))
    assert [z[row(f"L_{j}")] for j in "abc"] == pytest.approx(PLANT.motor.L * np.array([0.64, 1, 0.25]))


def test_eccentricity_modulates_the_torque_once_per_turn():
    """k6: κ_j × [1 + ζ cos(θ_m - 2πj/3)]."""
    tops, clear = flat_tops()
    wobble = 0.2 * np.cos(ANGLES - 2 * np.pi / 3 * np.arange(3)[:, None])
    expected = PLANT.motor.k_e * 5.0 * np.sum(np.abs(tops) * (1 + wobble), axis=0)
    assert np.allclose(shaft_torque([0, 0, 0, 0, 0, 0.2])[clear], expected[clear], rtol=0.015)


def test_end_stop_stalls_the_motor():
    """Beyond its travel the user stands still, the motor too, and the current is at its limit."""
    near = varied(transmission={"theta_stop": 0.002}, inverter={"I_max": 6.0})
    r = hf.simulate(near, np.zeros(6), np.full(3000, 0.01))
    assert r.theta_u[0, 1000:].max() <= 0.002 + 2 * PLANT.sensors.lvdt_step
    assert np.abs(r.w_m[0, 1000:]).max() == 0.0
    assert r.envelope[0, 2000] == pytest.approx(6.0, rel=0.05)


def test_state_carries_over():
    """Two halves in sequence are the whole, as long as noise is the same (here: none)."""
    command = np.concatenate([PLANT.command(), np.zeros(1000)])
    whole = hf.simulate(PLANT, np.zeros(6), command, noise=False)
    first = hf.simulate(PLANT, np.zeros(6), command[:3001], noise=False)
    second = hf.simulate(PLANT, np.zeros(6), command[3000:], noise=False, start=first.state)
    assert np.array_equal(whole.theta_m[:, 3000:], second.theta_m)
    assert np.array_equal(whole.i[:, :, 3000:], second.i)


def test_a_record_depends_on_its_seed_only():
    k = np.random.default_rng(3).uniform(0, 0.3, (20, 6))
    seeds = np.arange(20)
    together = hf.simulate(PLANT, k, seeds=seeds, n_threads=2)
    order = np.random.default_rng(4).permutation(20)
    shuffled = hf.simulate(PLANT, k[order], seeds=seeds[order])
    assert np.array_equal(together.i[order], shuffled.i)
    other = hf.simulate(PLANT, k, seeds=seeds + 1000)
    assert not np.array_equal(together.i, other.i)


def test_lanes_and_single_run_agree():
    """One run alone and in a batch of sixteen: the same to rounding, before switching decorrelates them."""
    k = np.random.default_rng(5).uniform(0, 0.3, (16, 6))
    batch = hf.simulate(PLANT, k, PLANT.command()[:300], noise=False)
    for j in (0, 7, 15):
        alone = hf.simulate(PLANT, k[j], PLANT.command()[:300], noise=False)
        assert np.abs(alone.i[0] - batch.i[j]).max() < 1e-9


@pytest.mark.parametrize("offset", [-9.2e-5, 6e-5, 9.2e-5])
def test_a_start_off_the_command_is_at_rest_with_its_holding_current(offset):
    """Stiction holds; what the recorder reads at first is what it reads when the start is forgotten."""
    start = hf.start_at(PLANT, np.array([offset]), np.array([offset * PLANT.transmission.GR]))
    r = hf.simulate(PLANT, np.zeros(6), np.zeros(600), start=start)
    assert np.ptp(r.theta_m) < PLANT.transmission.GR * PLANT.sensors.lvdt_step  # ripple may make it creep
    x = 0.5 * np.abs(r.i[0]).sum(axis=0)
    assert x[:30].mean() == pytest.approx(x[300:].mean(), abs=0.08)


def test_a_clock_that_is_slow_is_a_slower_controller():
    slow = 0.004
    plant = varied(control={"rate": PLANT.control.rate / (1.0 + slow)})
    shared = runs(effects={"clock_skew": {"shared": slow}}, noise=False)
    slower = runs(plant=plant, command=PLANT.command(), dt=hf.DT * (1.0 + slow), noise=False)
    np.testing.assert_allclose(shared.theta_u, slower.theta_u, rtol=1e-9)
    np.testing.assert_allclose(shared.i, slower.i, atol=1e-6)


def test_a_slow_recorder_sees_the_motion_early_to_the_end(nominal):
    late = 0.004
    recorded = runs(effects={"clock_skew": {"rate": late}}, noise=False)
    t = nominal.t
    longer = runs(command=np.append(PLANT.command(), np.full(50, PLANT.command()[-1])), noise=False)
    seen = np.interp(t * (1.0 + late), longer.t, longer.theta_m[0])
    assert np.abs(recorded.theta_m[0] - seen).max() < 1e-4 * np.ptp(seen)


@pytest.mark.parametrize(("currents", "late"), [(0.0, 2e-4), (1e-3, -3e-4), (-1e-3, 1e-3)])
def test_currents_may_have_a_clock_of_their_own(nominal, currents, late):
    recorded = runs(effects={"clock_skew": {"currents": currents, "late": late}}, noise=False)
    longer = runs(command=np.append(PLANT.command(), np.full(50, PLANT.command()[-1])), noise=False)
    seen = np.interp(nominal.t * (1.0 + currents) + late, longer.t, envelope(longer.i, PLANT.control.rate)[0])
    inside = slice(200, -200)  # the envelope's filter has ends
    assert np.abs(envelope(recorded.i, PLANT.control.rate)[0] - seen)[inside].max() < 0.02 * seen.max()
    np.testing.assert_allclose(recorded.theta_m, longer.theta_m[:, : len(nominal.t)], atol=1e-9)


def test_a_run_does_not_mind_a_slow_recorder_beside_it():
    def with_recorders(*rates: float) -> hf.Response:
        return hf.simulate(PLANT, np.zeros((2, 6)), seeds=1, effects={"clock_skew": {"rate": np.array(rates)}})

    beside, alone = with_recorders(0.0, 0.004), with_recorders(0.0, 0.0)
    assert np.array_equal(beside.theta_m[0], alone.theta_m[0])
    assert np.array_equal(beside.state[0], alone.state[0])
    assert not np.array_equal(beside.theta_m[1], alone.theta_m[1])


def test_effects_act_on_their_own_runs_only():
    """Runs of one call need not have the same effects, and each is as it would be without the others."""
    k, seeds = np.zeros((3, 6)), np.arange(3)
    plain = hf.simulate(PLANT, k, seeds=seeds)
    drag, sag = (
        {"viscous_drag": {"coefficient": np.array([0.0, 6e-5, 0.0])}},
        {"supply_sag": {"resistance": np.array([0, 0, 0.3])}},
    )
    alone, together = (
        hf.simulate(PLANT, k, seeds=seeds, effects=drag),
        hf.simulate(PLANT, k, seeds=seeds, effects={**drag, **sag}),
    )
    np.testing.assert_array_equal(together.i[0], plain.i[0])
    np.testing.assert_array_equal(together.i[1], alone.i[1])
    assert np.abs(together.i[1] - plain.i[1]).max() > 0.1
    assert np.abs(together.u_dc[2] - plain.u_dc[2]).max() > 0.1


def test_a_slower_anti_alias_filter_is_one_of_lower_corner_and_changes_nothing_else():
    slower = hf.simulate(PLANT, np.zeros(6), seeds=1, effects={"current_filter": {"change": 1.0}})
    lower = hf.simulate(varied(sensors={"f_lag": 0.5 * PLANT.sensors.f_lag}), np.zeros(6), seeds=1)
    assert np.array_equal(slower.i, lower.i)
    assert np.array_equal(slower.theta_m, hf.simulate(PLANT, np.zeros(6), seeds=1).theta_m)


def test_late_comparators_let_the_current_leave_the_band_by_what_it_moves_meanwhile():
    """Overshoot of a held motor's current over the band: less than slope x delay, with the whole supply across L."""
    held = varied(control={"rate": 1e5}, sensors={"f_lag": 1e5}, transmission={"F_s": 10.0, "F_d": 9.0})
    command = np.full(20_000, 0.002)  # the controller asks for 6 A

    def highest(delay: float) -> float:
        r = hf.simulate(held, np.zeros(6), command, noise=False, effects={"comparator_delay": {"time": delay}})
        return float(np.abs(r.i[0, :, 1000:]).max() - abs(r.I_ref[0, -1]))

    slope = held.inverter.V_dc / held.motor.L
    none, half, one, three = map(highest, (0.0, 0.5e-6, 1e-6, 3e-6))
    assert none < half < one < three < none + 3e-6 * slope


def test_currents_are_recorded_as_far_as_the_converter_reaches():
    """Without a limit of its own that is the plant's range, whatever it is; with one, that."""
    strong = {
        "inverter": {"I_max": 50.0, "V_dc": 150.0},
        "transmission": {"F_s": 10.0, "F_d": 9.0},
    }  # held: it draws what it may
    command = np.full(1000, 0.05)

    def top(adc_range: float, **effects) -> float:
        plant = varied(**strong, sensors={"adc_range": adc_range})
        return float(np.abs(hf.simulate(plant, np.zeros(6), command, effects=effects).i).max())

    step = 2 * 100.0 / 2**PLANT.sensors.adc_bits
    true = top(100.0)
    assert 40.0 < true < 60.0
    assert top(35.0) == pytest.approx(35.0, abs=step)
    assert top(100.0, adc_saturation={"limit": 38.0}) == pytest.approx(38.0, abs=step)
    assert top(100.0, adc_saturation={"limit": 12.0}) == pytest.approx(12.0, abs=step)
    neutral = registry()["adc_saturation"].neutral()["limit"]  # clips nothing that any plant's converter would record
    assert varied(sensors={"adc_range": neutral}).sensors.adc_range == neutral
    with pytest.raises(ValidationError):
        varied(sensors={"adc_range": 1.001 * neutral})


@pytest.mark.parametrize("signal", ["position", "speed"])
def test_a_delay_is_as_long_as_it_is_said_at_any_rate_of_control(signal):
    """At twice the rate it is twice as many ticks; longer than the record, the controller sees the start only."""
    fast = varied(control={"rate": 5e4}, motion={"duration": 0.2})

    def seen(delay: float) -> np.ndarray:
        effects = {f"{signal}_delay": {"time": delay}}
        return hf.simulate(fast, np.zeros(6), noise=False, effects=effects).I_ref[0]

    plain, one, four = seen(0.0), seen(1.3e-3), seen(4e-3)
    assert np.abs(four - one).max() > 0.1
    assert not np.array_equal(four, plain)
    never = seen(10.0)
    assert np.array_equal(never, seen(20.0))
    assert not np.array_equal(never, four)


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_a_resolvers_error_is_in_the_speed_as_far_as_the_speed_comes_from_it(share):
    wave = {"once_cosine": 0.02, "twice_sine": 0.01}
    made = runs(effects={"resolver_error": {**wave, "in_speed": share}})
    theta, w = made.theta_m, made.w_m
    tick = float(np.diff(made.t)[0])
    error = np.diff(0.02 * np.cos(theta) + 0.01 * np.sin(2.0 * theta), axis=-1) / tick
    true = np.diff(theta, axis=-1) / tick - error
    w = 0.5 * (w[:, 1:] + w[:, :-1])  # as true as the mean over a tick
    error = 0.5 * (error + np.roll(error, 1, axis=-1))
    beyond, error = (w - true)[:, 1:], error[:, 1:]
    assert np.sum(beyond * error) / np.sum(error**2) == pytest.approx(share, abs=0.05)


@pytest.mark.parametrize("law", ["per_ampere", "inductance_per_ampere"])
def test_iron_that_gives_way_from_the_first_ampere_lowers_what_it_is_said_to(law):
    """At a tenth per ampere, one ampere finds 1/1.1 of the torque constant, or of the inductance."""
    saturation = registry()["saturation"]
    values = [0.1 if p.name == law else 0.0 for p in saturation.parameters]
    emf, L = saturation.laws["emf_factor"](-1.0, 0.0, *values), saturation.laws["inductance_factor"](-1.0, *values)
    assert (emf, L) == pytest.approx((1.0 / 1.1, 1.0) if law == "per_ampere" else (1.0, 1.0 / 1.1))


def test_in_dead_time_a_leg_lies_between_the_rails_where_the_current_is_small():
    def leg(i, below):
        return leg_voltage(1.0, i, 48.0, 0.0, 1.0, below)

    i = np.linspace(-1.0, 1.0, 41)
    soft = np.array([leg(x, 0.5) for x in i])
    assert soft == pytest.approx(-24.0 * np.clip(i / 0.5, -1.0, 1.0))
    assert [leg(x, 0.0) for x in (-0.01, 0.01)] == [24.0, -24.0]


def test_dead_time_costs_less_where_its_switches_have_capacitance(nominal):
    hard, soft = (runs(effects={"dead_time": {"time": 3e-6, "below": x}}) for x in (0.0, 1.0))
    off = [rms((r.envelope - nominal.envelope).mean(axis=0)) for r in (hard, soft)]
    assert 0.0 < off[1] < 0.9 * off[0]
