from __future__ import annotations

import pytest

from ema.core import config, resources
from ema.core.errors import ConfigError
from ema.models import actuator_file, axis_config
from ema.models.actuator import Actuator

PLANT = resources.config("actuator.yaml")


def broken(tmp_path, old: str, new: str):
    text = PLANT.read_text()
    assert old in text
    path = tmp_path / "actuator.yaml"
    path.write_text(text.replace(old, new, 1))
    return path


def test_numbers_carry_their_units():
    plant = config.load(PLANT, Actuator)
    assert pytest.approx(0.36e-3) == plant.motor.L
    assert plant.sensors.current_noise == pytest.approx(5e-3)
    assert plant.control.rate == pytest.approx(1e4)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("R: 1.065 ohm", "R: 1.065 V", ["motor.R", "wrong unit", "[ohm]"]),
        ("R: 1.065 ohm", "R: 1.065 furlongbananas", ["motor.R", "[ohm]"]),
        ("R: 1.065 ohm", "R: -1", ["motor.R", "-1", "greater than 0"]),
        ("R: 1.065 ohm", "R: .nan", ["motor.R", "finite"]),
        ("R: 1.065 ohm", "r: 1.065", ["motor.R", "missing"]),
        ("R: 1.065 ohm", "R: 1\n  R: 2", ["given twice", "line"]),
        ("p: 2 ", "p: 2.5 ", ["motor.p"]),
        ("p: 2 ", "p: true ", ["motor.p", "True", "no number"]),
        ("R: 1.065 ohm", "R: yes", ["motor.R", "True", "no number"]),
        ("F_s: 0.04 N m", "F_s: 0.01 N m", ["transmission", "F_s", "F_d"]),
        ("motor:", "engine:", ["motor", "missing"]),
        ("kind: ema", "kind: axis", ["kind", "axis"]),
    ],
)
def test_a_wrong_value_is_named_with_file_key_and_range(tmp_path, old, new, says):
    path = broken(tmp_path, old, new)
    with pytest.raises(ConfigError) as error:
        config.load(path, Actuator)
    message = str(error.value)
    assert "\n" not in message
    for part in (str(path), *says):
        assert part in message


@pytest.mark.parametrize("text", ["", "- a\n- b\n", "a: [1, 2", "a: \t b", "\xff", "? [1]\n: 2\n"])
def test_what_is_not_a_yaml_mapping_is_refused_in_one_line(tmp_path, text):
    path = tmp_path / "x.yaml"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(ConfigError, match=str(path)):
        config.load(path, Actuator)


def test_a_missing_file_is_named():
    with pytest.raises(ConfigError, match=r"nowhere\.yaml: cannot be read"):
        config.load("nowhere.yaml", Actuator)


def test_equal_meaning_has_equal_digest(tmp_path):
    other = config.load(broken(tmp_path, "L: 0.36 mH", "L: 0.37 mH"), Actuator)
    same = config.load(broken(tmp_path, "L: 0.36 mH", "L: 3.6e-4   # H"), Actuator)
    plant = config.load(PLANT, Actuator)
    assert config.digest(same) == config.digest(plant)
    assert config.digest(other) != config.digest(plant)


CANNOT_BE = [
    ("gremlins: {size: 1}", "effect 'gremlins' is unknown"),
    ("cogging: {size: 1}", "effect 'cogging' has no parameter 'size'"),
    ("cogging: {amplitude: .inf}", "finite"),
    ("gear_compliance: {compliance: 1e-5, inertia: 0}", "effect 'gear_compliance': inertia = 0 must be above 0"),
    ("inertia: {change: -1}", "effect 'inertia': change = -1 must be above -1"),
    ("speed_delay: {time: -1e-3}", "effect 'speed_delay': time = -0.001 must be at least 0"),
    ("saturation: {emf: -0.01}", "effect 'saturation': emf = -0.01 must be at least 0"),
]


def test_what_is_wrong_with_a_whole_file_is_told_without_the_file():
    with pytest.raises(ConfigError, match=r"^here: drive: voltage needs R, k_e and k_t$"):
        config.validate({"kind": "axis", "J": 1e-4, "F_d": 0.01, "drive": "voltage"}, axis_config.RotaryAxis, "here")


def test_a_key_of_a_section_is_sent_there():
    plant = {
        "kind": "axis",
        "J": 1e-4,
        "F_d": 0.01,
        "drive": "speed-loop",
        "k_t": 0.1,
        "loop": {"K_w": 1.0},
        "I_max": 3.0,
    }
    with pytest.raises(ConfigError, match="'I_max' is unknown; it belongs to 'loop'"):
        config.validate(plant, axis_config.RotaryAxis, "here")


@pytest.mark.parametrize(
    ("load", "name"),
    [(actuator_file.load, "actuator.yaml"), (axis_config.load, "laas_mn4004.yaml")],
    ids=["ema", "axis"],
)
@pytest.mark.parametrize(("effect", "says"), CANNOT_BE)
def test_an_effect_that_cannot_be_simulated_is_refused_with_its_file(tmp_path, load, name, effect, says):
    path = tmp_path / name
    text = resources.config(name).read_text()
    path.write_text(text.replace("effects: {}", f"effects: {{{effect}}}"))
    with pytest.raises(ConfigError) as error:
        load(path)
    for part in (str(path), "'effects", says):
        assert part in str(error.value)


@pytest.mark.parametrize(
    "effect", ["cogging: {amplitude: 0.3}", "speed_torque: {torque_3: 0.4}", "position_delay: {time: 20e-3}"]
)
def test_what_is_only_unlikely_is_accepted(tmp_path, effect):
    """The library's bounds are where a search looks; a plant may be another one."""
    actuator_file.load(broken(tmp_path, "effects: {}", f"effects: {{{effect}}}"))


def test_a_table_without_width_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="low = 1 must be below high = 1"):
        actuator_file.load(broken(tmp_path, "effects: {}", "effects: {speed_torque: {low: 1, high: 1}}"))
