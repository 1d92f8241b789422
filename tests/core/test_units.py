import pytest

from ema.core.units import convert, is_unit, plain, to_unit


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("0.36 mH", "H", 0.00036),
        ("6e4 1/s", "1/s", 6e4),
        ("6e4 / s", "1/s", 6e4),
        ("5e-3rad", "rad", 5e-3),
        ("-0.12 %/K", "1/K", -0.0012),
        ("20 °C", "K", 293.15),
        ("3e-5 N m s/rad", "N m s/rad", 3e-5),
        ("2.5 kg*m**2", "kg m^2", 2.5),
        ("3 m/(s^2)", "m/s^2", 3.0),
        ("1.5e-3 N*m/A^2", "N m/A^2", 1.5e-3),
        ("30 %", "", 0.3),
    ],
)
def test_a_number_with_its_unit(text, unit, value):
    assert to_unit(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("unit", "scale"), [("rpm", 0.10471975511965977), ("rev/min", 0.10471975511965977), ("deg/s", 0.017453292519943295)]
)
def test_angular_speeds(unit, scale):
    assert convert(unit, "rad/s") == pytest.approx((scale, 0.0))


@pytest.mark.parametrize(("name", "unit"), [("1/min", "rad/s"), ("Hz", "rad/s"), ("1/s", "rad/s"), ("counts", "rad")])
def test_what_does_not_say_of_which_angle_is_not_taken_for_radians(name, unit):
    with pytest.raises(ValueError, match="does not say of which angle; write rad"):
        convert(name, unit)
    with pytest.raises(ValueError, match="does not say of which angle; write rad"):
        to_unit(f"3 {name}", unit)


@pytest.mark.parametrize(
    "text", ["9**9**9**9 s", "3 s**9**9", "3 s^99", "0.3 s\n{", "3 s (", "3 __import__", "[]", "s" * 500]
)
def test_what_is_no_quantity_is_refused_and_not_calculated(text):
    with pytest.raises(ValueError, match="is not a number with a unit"):
        to_unit(text, "s")
    with pytest.raises(ValueError, match="is not a known unit"):
        convert(text, "s")


def test_where_no_unit_is_known_a_text_with_one_is_refused():
    assert plain("6.0e4") == 6.0e4
    assert plain(3) == 3
    with pytest.raises(ValueError, match="a number without a unit is wanted here"):
        plain("6e-5 N m s/rad")


@pytest.mark.parametrize(
    ("written", "unit", "scale"),
    [("Nm", "N m", 1.0), ("mNm", "N m", 1e-3), ("N·m", "N m", 1.0), ("Nmm", "N m", 1e-3), ("Nm/A", "N m/A", 1.0),
     ("Amps", "A", 1.0), ("RPM", "rad/s", 0.10471975511965977)],
)  # fmt: skip
def test_units_as_engineers_write_them(written, unit, scale):
    assert is_unit(written)
    assert convert(written, unit) == pytest.approx((scale, 0.0))
    assert to_unit(f"2 {written}", unit) == pytest.approx(2.0 * scale)
