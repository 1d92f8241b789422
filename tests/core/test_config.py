from __future__ import annotations

import pytest

from ema.core import config, resources
from ema.core.errors import ConfigError
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
