"""What a record is enough for, by its channels alone."""

from __future__ import annotations

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.records.agreements import agreements
from ema.discrepancy.records.allowed import list_allowed
from ema.discrepancy.records.facts import channels, sampling
from ema.models.axis_config import RotaryAxis

T = np.arange(0.0, 2.0, 1e-3)
RNG = np.random.default_rng(1)
AXIS = {"t": T, "i_q": np.sin(9.0 * T) + 0.01 * RNG.standard_normal(len(T)), "w_m": 3.0 * np.cos(7.0 * T)}


def of(**named: np.ndarray):
    record = Record((Cycle(0, named),))
    return list_allowed(record, sampling(record), channels(record), list(agreements(record)))


def test_a_current_and_a_speed_are_an_axis_and_lack_an_actuators_channels():
    found = of(**AXIS)
    assert set(found.plants) == {"axis"}
    assert "driven by i_q" in found.plants["axis"]
    assert "theta_cmd [rad]" in found.missing["ema"]


@pytest.mark.parametrize(("lacking", "said"), [("i_q", "a drive"), ("w_m", "a position or a speed")])
def test_what_is_lacking_is_said(lacking, said):
    found = of(**{name: x for name, x in AXIS.items() if name != lacking})
    assert found.plants == {}
    assert [text.split(":")[0] for text in found.missing["axis"]] == [said]


def test_a_clean_record_has_nothing_in_the_way():
    assert of(**AXIS).obstacles == []


def test_a_constant_channel_a_short_record_and_a_gap_stand_in_the_way():
    short = {name: x[:400] for name, x in AXIS.items()} | {"u_dc": np.full(400, 48.0)}
    said = " ".join(of(**short).obstacles)
    assert "u_dc is constant at 48 V" in said
    assert "400 samples: too few" in said
    late = {**AXIS, "t": np.where(T > 1.0, T + 0.5, T)}
    assert "1 gaps, the longest 0.501 s" in " ".join(of(**late).obstacles)


def test_a_drive_that_is_clipped_is_told():
    clipped = {**AXIS, "i_q": np.clip(AXIS["i_q"], -0.6, 0.6)}
    assert any("i_q is held at an end of its range" in text for text in of(**clipped).obstacles)


def test_a_limit_of_a_commanded_drive_and_levels_of_a_command_are_in_nobodys_way():
    steps = np.repeat(RNG.choice([-0.9, -0.4, 0.1, 0.6, 0.943, 0.3, -0.2], 40), 50)
    moving = {"t": T, "theta_m": np.cumsum(np.cumsum(steps)) * 1e-6 + 1e-7 * RNG.standard_normal(len(T))}
    assert of(**moving, duty=steps).obstacles == []
    assert of(**moving, i_q=np.sign(steps) * 4.0).obstacles == []


def test_of_readings_at_rest_neither_clock_nor_acceleration_is_spoken_of():
    angle = np.repeat(np.linspace(0.0, 6.0, 1000), 2)
    held = {"t": np.arange(2000.0), "theta_m": angle, "i_q": np.sin(12.0 * angle), "w_m": np.zeros(2000)}
    record = Record((Cycle(0, held),))
    assert agreements(record) == []
    assert of(**held).obstacles == []


def test_with_a_plant_file_what_drives_and_what_is_refused_is_told():
    white = {"t": T, "theta_m": np.cumsum(RNG.standard_normal(len(T))), "duty": RNG.standard_normal(len(T))}
    record = Record((Cycle(0, {**white, "i_q": AXIS["i_q"]}),))
    facts = channels(record)

    def with_drive(record, drive):
        plant = RotaryAxis(kind="axis", J=1e-4, F_d=0.01, drive=drive, k_t=0.1, k_e=0.1, R=1.0, V_dc=24.0)
        return list_allowed(record, sampling(record), facts, list(agreements(record)), plant)

    by_current = with_drive(record, "current")
    assert (by_current.plants["axis"].endswith("driven by i_q"), by_current.refused) == (True, "")
    assert not any("sampled too slowly" in text for text in by_current.obstacles)
    by_voltage = with_drive(Record((Cycle(0, white),)), "voltage")
    assert "changes faster than a sample" in by_voltage.refused
    assert "missing channel torque" in with_drive(record, "torque").refused
