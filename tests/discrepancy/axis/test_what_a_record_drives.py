"""Which channel drives and which are compared, what is refused and why, and typical sizes."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import on_paper
import pytest

from ema.core.errors import RecordError
from ema.core.records import Cycle, Record
from ema.discrepancy.axis.reading.channels import roles
from ema.discrepancy.axis.reading.intake import SHORTEST, ask_of_loop, of_loop, take_in
from ema.discrepancy.axis.reading.sizes import WARMING, sizes
from ema.models.axis_config import PositionLoop, RotaryAxis

BASE = {"J": on_paper.J, "C": on_paper.C, "F_d": on_paper.F_D, "k_t": on_paper.K_T}
CURRENT = RotaryAxis.model_validate(BASE)
VOLTAGE = RotaryAxis.model_validate({**BASE, "drive": "voltage", "k_e": 0.05, "R": 0.8, "V_dc": 24.0})


def record(**changes) -> Record:
    """The swing on paper with channels replaced, added, or (None) left out."""
    channels = {**on_paper.cycle().channels, **changes}
    return Record((Cycle(0, {name: x for name, x in channels.items() if x is not None}),))


@pytest.fixture(scope="module")
def swing():
    return on_paper.cycle()


def only(plant, *records):
    ((cycle,),) = (r.cycles for r in take_in(plant, records))
    return cycle


def test_a_duty_cycle_is_a_share_of_the_supply(swing):
    duty = 0.1 * np.sin(swing["t"])
    assert only(VOLTAGE, record(duty=duty, i_q=None))["u_q"] == pytest.approx(24.0 * duty)
    sagging = 24.0 - swing["t"]
    assert only(VOLTAGE, record(duty=duty, u_dc=sagging))["u_q"] == pytest.approx(sagging * duty)
    without = VOLTAGE.model_copy(update={"V_dc": None})
    with pytest.raises(RecordError, match="duty is a share of the supply"):
        take_in(without, [record(duty=duty)])


@pytest.mark.parametrize(("torque_at", "measured_at", "factor"), [("motor", "load", 20.0), ("load", "motor", 0.05)])
def test_a_torque_beyond_the_gear_is_taken_where_the_angle_is(swing, torque_at, measured_at, factor):
    geared = {"drive": "torque", "gear": 20.0, "torque_at": torque_at, "measured_at": measured_at}
    plant = RotaryAxis.model_validate({"J": 1e-3, "F_d": 0.1, **geared})
    tau = np.sin(swing["t"])
    assert only(plant, record(torque=tau, i_q=None))["torque"] == pytest.approx(factor * tau)


def test_a_position_loop_asks_by_its_error_speed_and_direction_up_to_its_limit():
    loop = PositionLoop(K_p=2.0, K_d=0.5, k_v=0.8, F_c=0.1, limit=1.0)
    error, w_ref, w = np.array([0.1, 0.0, 5.0]), np.array([1.0, -1.0, 0.0]), np.array([0.5, 0.0, 0.0])
    assert of_loop(loop, error, w_ref, w) == pytest.approx([0.2 + 0.15 + 0.1, -0.4 - 0.1, 1.0])


def test_what_a_loop_asks_for_drives_only_where_no_current_is_recorded(swing):
    looped = RotaryAxis.model_validate({**BASE, "position_loop": {"K_p": 3.0, "K_d": 0.2}})
    reference = swing["theta_m"] + 0.01
    made = only(looped, record(theta_ref=reference, i_q=None))["i_q"]
    true_w = on_paper.Swing().at(swing["t"])[1]
    w_ref = np.gradient(reference, swing["t"])
    assert np.median(np.abs(made - 3.0 * 0.01 - 0.2 * (w_ref - true_w))) < 0.05
    assert only(looped, record(theta_ref=reference))["i_q"] is swing["i_q"] or np.array_equal(
        only(looped, record(theta_ref=reference))["i_q"], swing["i_q"]
    )
    by_duty = {"position_loop": {"K_p": 3.0, "gives": "duty"}, "drive": "voltage", "k_e": 0.05, "R": 0.8}
    u = np.cos(swing["t"])
    assert "duty" not in only(RotaryAxis.model_validate({**BASE, **by_duty}), record(u_q=u))
    with pytest.raises(RecordError, match="needs the channel theta_ref"):
        ask_of_loop(looped, looped.position_loop, swing, "bench")


def test_a_current_that_is_off_is_none_and_of_a_voltage_that_is_off_nothing_is_known(swing):
    on = np.ones(len(swing["t"]))
    on[1000:1500] = 0.0
    off = only(CURRENT, record(enabled=on))
    assert (off["i_q"][1000:1500] == 0.0).all()
    assert np.array_equal(off["i_q"][:1000], swing["i_q"][:1000])
    offset = np.where(on > 0.5, swing["i_q"], 0.02) + 0.01 * np.random.default_rng(1).standard_normal(len(on))
    assert np.array_equal(only(CURRENT, record(i_q=offset, enabled=on))["i_q"], offset)  # what its sensor shows of none
    (parts,) = (r.cycles for r in take_in(VOLTAGE, [record(u_q=np.cos(swing["t"]), enabled=on)]))
    assert [c.n_samples for c in parts] == [1000, len(on) - 1500]
    assert len({c.number for c in parts}) == 2
    on[: -SHORTEST + 1] = 0.0
    on[-SHORTEST + 1 :] = 1.0
    (parts,) = (r.cycles for r in take_in(VOLTAGE, [record(u_q=np.cos(swing["t"]), enabled=on)]))
    assert len(parts) == 0


def test_roles_of_a_current_and_of_a_voltage(swing):
    who = roles(CURRENT, record())
    assert (who.kind, who.drive, who.outputs) == ("current", "i_q", ("theta_m", "w_m"))
    who = roles(VOLTAGE, record(u_q=np.cos(swing["t"]), w_m=None))
    assert (who.kind, who.drive, who.outputs, who.speed) == ("voltage", "u_q", ("theta_m", "i_q"), None)


def test_a_voltage_that_stays_constant_drives_whatever_the_plant_file_says(swing):
    electric = RotaryAxis.model_validate({**BASE, "k_e": 0.05, "R": 0.8})
    assert roles(electric, record(u_q=np.full(len(swing["t"]), 2.0))).kind == "voltage"
    assert roles(electric, record(u_q=np.cos(swing["t"]))).kind == "current"
    assert roles(electric, record(u_q=np.cos(swing["t"]))).outputs[-1] == "u_q"


def turned_on_its_head(swing):
    return {"w_m": -swing["w_m"]}


def in_degrees(swing):
    return {"theta_m": np.rad2deg(swing["theta_m"])}


def clipped(swing):
    return {"i_q": np.clip(swing["i_q"], -0.2, 0.2)}


def not_a_number(swing):
    return {"w_m": np.where(np.arange(len(swing["t"])) == 77, np.nan, swing["w_m"])}


def at_rest(swing):
    return {"w_m": 0.0 * swing["t"], "theta_m": 0.0 * swing["t"]}


def nowhere(swing):
    return {"w_m": None, "theta_m": None}


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (turned_on_its_head, "another unit or sign"),
        (in_degrees, "another unit or sign"),
        (clipped, "i_q is clipped at 0.2 A"),
        (not_a_number, "w_m is not a number at t = 0.077 s"),
        (at_rest, "does not move"),
        (nowhere, "missing channel theta_m"),
    ],
)
def test_what_cannot_be_examined_is_refused_with_its_reason(swing, change, why):
    with pytest.raises(RecordError, match=why):
        roles(CURRENT, record(**change(swing)))


def wavering(seed, lag):
    """A motion that never repeats, whose current is recorded `lag` samples late."""
    rng = np.random.default_rng(seed)
    swing = on_paper.Swing(tuple((1.0 / f, f, rng.uniform(0.0, 6.0)) for f in rng.uniform(2.0, 40.0, 12)))
    cycle = on_paper.cycle(swing=swing)
    return Record((Cycle(0, {**cycle.channels, "i_q": np.roll(cycle["i_q"], lag)}),))


def test_a_delay_of_fast_motion_is_none_of_channels_out_of_step():
    """Here the current is against what the motion needs, but no later than what can be examined."""
    swing = on_paper.Swing(((0.02, 110.0, 0.3), (0.02, 97.0, 1.0), (0.02, 121.0, 2.0)))
    cycle = on_paper.cycle(swing=swing)
    late = {**cycle.channels, "i_q": np.roll(cycle["i_q"], 25)}
    assert roles(CURRENT, Record((Cycle(0, late),))).kind == "current"


def test_channels_out_of_step_are_refused_and_a_delay_is_examined():
    roles(CURRENT, wavering(1, 10))
    with pytest.raises(RecordError, match=r"w_m runs 0\.4 s ahead of i_q"):
        roles(CURRENT, wavering(1, 400))


def test_an_axis_that_comes_to_rest_at_its_end_is_not_clipped_and_a_sensor_at_its_limit_is(swing):
    t = swing["t"]
    looped = RotaryAxis.model_validate({**BASE, "position_loop": {"K_p": 3.0}})
    ends = 1.0 - np.exp(-t / 0.3) * (1.0 + t / 0.3)
    ends[ends > 0.9999] = ends.max()
    roles(looped, record(theta_m=ends, w_m=None))
    with pytest.raises(RecordError, match="theta_m is clipped"):
        roles(looped, record(theta_m=np.minimum(swing["theta_m"], 1.0), w_m=None))


def test_sizes_are_those_of_the_record(swing):
    plant = on_paper.plant(swing)
    s = sizes(plant)

    def rms(x):
        return float(np.sqrt(np.mean(x**2)))

    assert s.torque == pytest.approx(on_paper.K_T * rms(swing["i_q"]), rel=0.05)
    assert s.speed == pytest.approx(rms(swing["w_m"]), rel=0.05)
    assert s.centre + s.half_range == pytest.approx(swing["theta_m"].max(), rel=0.02)
    assert s.period == pytest.approx(1e-3)
    assert (s.driven_by, s.turns, s.moves, s.warms, s.is_force) == ("current", True, True, False, False)
    assert s.outputs == {"theta_m", "w_m"}


def test_windings_that_warm_and_a_current_by_resistance(swing):
    plant = on_paper.plant(swing)
    hotter = [replace(w, dT=2.0 * WARMING * k / len(plant.windows)) for k, w in enumerate(plant.windows)]
    assert sizes(SimpleNamespace(plant=CURRENT, windows=hotter, benches=plant.benches)).warms
    s = sizes(SimpleNamespace(plant=VOLTAGE, windows=plant.windows, benches=plant.benches))
    assert s.voltage == pytest.approx(s.drive)
    assert s.current == pytest.approx(s.drive / 0.8)
    assert s.torque == pytest.approx(on_paper.K_T * s.current)
    assert s.supply == 24.0
