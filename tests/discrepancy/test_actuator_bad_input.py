"""Bad records are refused in one line that says what is missing or wrong."""

from __future__ import annotations

import re

import numpy as np
import pytest

from ema.core.errors import RecordError
from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.reading.cycles import prepare


@pytest.fixture(scope="module")
def good(hidden) -> dict[str, np.ndarray]:
    return hidden.cycles(hidden.Flaws(), 1)[0]


def record(channels: dict[str, np.ndarray]) -> Record:
    return Record((Cycle(0, channels),))


def changed(good: dict[str, np.ndarray], **new: np.ndarray) -> dict[str, np.ndarray]:
    return {**good, **new}


def test_good_record_is_accepted(good, shipped_plant):
    assert prepare(shipped_plant, [record(good)]).n_cycles == 1


@pytest.mark.parametrize("name", ["i_b", "theta_m", "theta_u", "theta_cmd"])
def test_missing_channel(good, shipped_plant, name):
    without = {key: x for key, x in good.items() if key != name}
    with pytest.raises(RecordError, match=f"missing channel {name}"):
        prepare(shipped_plant, [record(without)])


def test_too_short(good, shipped_plant):
    with pytest.raises(RecordError, match="at least 2000"):
        prepare(shipped_plant, [record({name: x[:900] for name, x in good.items()})])


@pytest.mark.parametrize("name", ["i_a", "theta_m", "theta_cmd"])
def test_constant(good, shipped_plant, name):
    with pytest.raises(RecordError, match=f"{name}.*constant|constant.*{name}"):
        prepare(shipped_plant, [record(changed(good, **{name: np.zeros(len(good["t"]))}))])


def test_clipped(good, shipped_plant):
    with pytest.raises(RecordError, match=r"i_a is clipped at 1 A"):
        prepare(shipped_plant, [record(changed(good, i_a=np.clip(good["i_a"], -1.0, 1.0)))])


def test_desynchronised(good, shipped_plant):
    late = {name: np.roll(good[name], 200) for name in ("i_a", "i_b", "i_c")}
    with pytest.raises(RecordError, match="not synchronised"):
        prepare(shipped_plant, [record(changed(good, **late))])


@pytest.mark.parametrize("seconds", [0.008, 0.02, -0.008, -0.02])
@pytest.mark.parametrize(
    ("names", "said"),
    [(["theta_u"], "θ_u come {} s {} θ_m"), (["i_a", "i_b", "i_c"], "the currents come {} s {} θ_m")],
    ids=["user", "currents"],
)
def test_what_is_late_and_by_how_much_is_told(good, shipped_plant, names, said, seconds):
    """Of a chirp whose user was 20 ms late the currents had been said to come 0.0495 s before."""
    at = (np.arange(len(good["t"])) - round(seconds / 1e-4)).clip(0, len(good["t"]) - 1)
    shifted = {name: good[name][at] for name in names}
    with pytest.raises(RecordError, match="not synchronised") as error:
        prepare(shipped_plant, [record(changed(good, **shifted))])
    told = re.search(said.format(r"([0-9.]+)", r"(after|before)"), str(error.value))
    assert told is not None
    assert float(told[1]) == pytest.approx(abs(seconds), abs=1e-3)
    assert told[2] == ("after" if seconds > 0.0 else "before")


@pytest.mark.parametrize("motion", ["chirp", "slow"])
def test_a_spring_that_takes_most_of_the_torque_is_no_lack_of_synchrony(hidden, shipped_plant, motion):
    motions = (hidden.chirp() if motion == "chirp" else hidden.sine(0.02, 2.0, 1.0),)
    (cycle,) = hidden.cycles(hidden.Flaws(spring=3000.0), 1, 3, motions)
    assert prepare(shipped_plant, [record(cycle)]).n_cycles == 1


@pytest.mark.parametrize("factor", [0.5, 0.8, 1.25, 3.0])
def test_other_gains_of_the_controller_are_no_lack_of_synchrony(good, shipped_plant, factor):
    """Wrong gains turn the phase of what the controller should ask for; that is something to find, not to refuse."""
    control = shipped_plant.control.model_copy(update={"K_p": factor * shipped_plant.control.K_p})
    other = shipped_plant.model_copy(update={"control": control})
    prepare(other, [record(good)])
    late = {name: np.roll(good[name], 200) for name in ("i_a", "i_b", "i_c")}
    with pytest.raises(RecordError, match="not synchronised"):
        prepare(other, [record(changed(good, **late))])


def test_another_plant(good, shipped_plant):
    with pytest.raises(RecordError, match="another plant"):
        prepare(shipped_plant, [record(changed(good, theta_m=0.2 * good["theta_m"]))])


def test_wrong_sampling(good, shipped_plant):
    with pytest.raises(RecordError, match="sampled at 5000 Hz"):
        prepare(shipped_plant, [record(changed(good, t=2.0 * good["t"]))])


def test_gap(good, shipped_plant):
    keep = np.r_[0:2000, 2100:5001]
    with pytest.raises(RecordError, match="gap"):
        prepare(shipped_plant, [record({name: x[keep] for name, x in good.items()})])
