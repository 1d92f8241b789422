from __future__ import annotations

import numpy as np
import pytest

from ema.core import config, resources
from ema.core.errors import RecordError
from ema.core.records import Cycle, Record
from ema.identification.alignment import aligned, alignment
from ema.models import hf
from ema.models.actuator import Actuator

PLANT = config.load(resources.config("actuator.yaml"), Actuator)


def turned(theta_0: float) -> Actuator:
    data = PLANT.model_dump()
    data["motor"]["theta_0"] = theta_0
    return Actuator.model_validate(data)


@pytest.mark.parametrize("theta_0", [-2.5, -np.pi / 2, 0.0, 0.4, np.pi / 2, 3.0])
@pytest.mark.parametrize("k", [(0, 0, 0, 0, 0, 0), (0.3, 0.2, 0.2, 0, 0.1, 0.2)])
def test_the_rotor_zero_is_found(theta_0, k):
    r = hf.simulate(turned(theta_0), np.array(k), seeds=3)
    found = alignment(r.i, r.theta_m, PLANT.motor.p, PLANT.control.rate)
    assert np.angle(np.exp(1j * (found.theta_0 - theta_0))) == pytest.approx(0.0, abs=0.12)
    assert not found.reversed_order
    assert found.coherence > 0.7


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("stiffness", [0.0, 15000.0])
@pytest.mark.parametrize("f", [2.0, 8.0])
def test_a_spring_that_drives_the_rotor_does_not_turn_the_sign_of_the_currents(sign, stiffness, f):
    """Against it the torque is opposite to the acceleration of a sine; friction still tells which sign is right."""
    command = 5e-3 * np.sin(2 * np.pi * f * PLANT.time())
    r = hf.simulate(PLANT, np.zeros(6), command, seeds=3, effects={"spring_load": {"stiffness": stiffness}})
    found = alignment(sign * r.i, r.theta_m, PLANT.motor.p, PLANT.control.rate)
    assert abs(found.theta_0) == pytest.approx(0.0 if sign > 0.0 else np.pi, abs=0.12)


def test_exchanged_phases_are_found():
    r = hf.simulate(turned(0.4), np.zeros(6), seeds=3)
    found = alignment(r.i[:, [0, 2, 1]], r.theta_m, PLANT.motor.p, PLANT.control.rate)
    assert found.reversed_order
    assert found.theta_0 == pytest.approx(0.4, abs=0.12)


def test_currents_that_do_not_follow_the_rotor_say_so():
    noise = np.random.default_rng(1).standard_normal((1, 3, 5001))
    r = hf.simulate(PLANT, np.zeros(6), seeds=3)
    assert alignment(noise, r.theta_m, PLANT.motor.p, PLANT.control.rate).coherence < 0.2


CURRENTS = ("i_a", "i_b", "i_c")


@pytest.fixture(scope="module")
def theirs(hidden) -> dict[str, np.ndarray]:
    """A cycle with faults, made by other code, with the plant's own conventions."""
    return hidden.cycles(hidden.Flaws(k1=0.05, k3=0.08, k6=0.05), 1, 4, motions=(hidden.chirp(),))[0]


def foreign(theirs, order=(0, 1, 2), sign=1.0, zero=0.0, p=None):
    """The same cycle as a simulation with other conventions would record it; `zero` [rad electrical]."""
    currents = {name: sign * theirs[CURRENTS[j]] for name, j in zip(CURRENTS, order, strict=True)}
    theta_m = (theirs["theta_m"] if p is None else theirs["theta_m"] * 2 / p) - zero / PLANT.motor.p
    return Record((Cycle(0, {**theirs, **currents, "theta_m": theta_m}),))


@pytest.mark.parametrize("order", [(0, 1, 2), (0, 2, 1), (1, 2, 0), (2, 1, 0), (2, 0, 1), (1, 0, 2)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_other_names_and_signs_of_the_phases_are_put_right_and_said(theirs, order, sign):
    record, notes = aligned(foreign(theirs, order, sign), PLANT)
    for name in CURRENTS:
        np.testing.assert_array_equal(record.cycles[0][name], theirs[name])
    said = " ".join(notes)
    assert ("opposite sign" in said) == (sign < 0)
    assert ("phases in the plant's order are" in said) == (order != (0, 1, 2))
    assert len(notes) == (sign < 0 or order != (0, 1, 2))


@pytest.mark.parametrize("order", [(0, 1, 2), (0, 2, 1)])
@pytest.mark.parametrize("zero", [0.5, -1.5, 1.6])
def test_another_rotor_zero_is_refused_with_the_one_that_would_be_right(theirs, order, zero):
    with pytest.raises(RecordError, match=r"set motor\.theta_0: (-?[\d.]+) rad in the plant file") as refused:
        aligned(foreign(theirs, order, zero=zero), PLANT)
    said = float(str(refused.value).split("set motor.theta_0: ")[1].split()[0])
    assert said == pytest.approx(zero, abs=0.15)
    assert ("exchanged" in str(refused.value)) == (order != (0, 1, 2))
    aligned(foreign(theirs, order, zero=zero), turned(said))  # what is said is right


def test_another_number_of_pole_pairs_is_refused(theirs):
    with pytest.raises(RecordError, match=r"with 5 pole pairs do, .* has motor\.p = 2"):
        aligned(foreign(theirs, p=5), PLANT)


def test_a_small_misadjustment_is_left_to_the_effect_of_that_name(theirs):
    record, notes = aligned(foreign(theirs, zero=0.08), PLANT)
    assert notes == []
    assert np.array_equal(record.cycles[0]["i_b"], theirs["i_b"])


def test_without_a_rotor_angle_nothing_is_said(theirs):
    record = Record((Cycle(0, {name: x for name, x in theirs.items() if name != "theta_m"}),))
    assert aligned(record, PLANT) == (record, [])
