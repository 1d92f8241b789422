"""What a record is enough for, by its channels alone."""

from __future__ import annotations

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.records.agreements import agreements
from ema.discrepancy.records.allowed import list_allowed
from ema.discrepancy.records.facts import channels, sampling

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
