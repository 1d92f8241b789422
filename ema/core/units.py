"""Physical quantities in configuration: a bare number is in the declared unit, a string carries its own.

`pint` is imported only when a string with a unit has to be converted, so that a process fed with bare
numbers (the daemon) stays small.
"""

from __future__ import annotations

import re
import tokenize
from functools import cache
from typing import Any

from pydantic import Field

LARGEST = 1e12  # no quantity of an actuator, a flight or a log, in the unit it is declared in, is larger
_TEXT = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*((?:1?\s*/\s*)?[^\W\d_].*|[°%].*)", re.DOTALL)
_UNIT = re.compile(r"[\w°%/*^ .()-]{0,60}")
_NO_POWER = re.compile(r"(?:\*\*|\^)\s*-?(?:\d\d|\s*\d?\s*(?:\*\*|\^))")  # pint would calculate 9**9**9**9
# As engineers write them: pint reads "Nm" as a number of metres, and knows "rpm" in small letters only.
_AS_WRITTEN = (
    "newton_meter = newton * meter = Nm",
    "newton_millimeter = newton * millimeter = Nmm",
    "@alias turn = rev",
    "@alias degree = Grad",
    "@alias revolutions_per_minute = RPM",
    "@alias ampere = Amp = amp = Amps = amps",
    "@alias volt = Volts = volts",
)
# What pint's parser lets through, beside its own errors.
_PARSER = (ValueError, TypeError, AssertionError, AttributeError, ArithmeticError, SyntaxError, tokenize.TokenError)


@cache
def _registry() -> Any:
    import pint

    # What pint reads otherwise is redefined on purpose: without a warning among the lines that people are shown.
    registry: Any = pint.UnitRegistry(autoconvert_offset_to_baseunit=True, on_redefinition="ignore")
    for definition in _AS_WRITTEN:
        registry.define(definition)
    return registry


def _check_angle(name: str, unit: str) -> None:
    """ValueError for counts, Hz or 1/min where an angle or angular speed is meant: pint takes each for a radian."""
    if unit not in ("rad", "rad/s"):
        return
    root = _registry().Quantity(1.0, name).to_root_units()
    if dict(root.unit_items()).get("radian") != 1:
        right = "rad, deg or turn" if unit == "rad" else "rad/s, deg/s or rpm"
        raise ValueError(f"[{name}] does not say of which angle; write {right}")


def to_unit(value: str, unit: str) -> float:
    """Convert a text such as ``"0.36 mH"`` to a number in `unit`; ValueError says what would be right."""
    try:
        return float(value)  # YAML reads 6.0e4 as text, for want of a sign in its exponent
    except ValueError:
        import pint
    try:
        number, name = _parted(value)
        quantity = _registry().Quantity(float(number), name)
        # 0.36 mH is 0.00036 H, not a bit less
        converted = float(f"{quantity.to(unit or 'dimensionless').magnitude:.15g}")
    except pint.DimensionalityError as error:
        raise ValueError(f"{value!r} has the wrong unit, expected [{unit or '1'}]") from error
    except (pint.PintError, *_PARSER) as error:
        raise ValueError(f"{value[:80]!r} is not a number with a unit of [{unit or '1'}]") from error
    _check_angle(name, unit)
    return converted


def _parted(text: str) -> tuple[str, str]:
    """Number and unit."""
    match = _TEXT.fullmatch(text.replace("·", "*"))
    if match is None:
        raise ValueError(text)
    number, unit = match.groups()
    unit = f"1{unit}" if unit.startswith("/") else unit
    _check(unit)
    return number, unit


def _check(unit: str) -> None:
    """ValueError for what is no unit: pint would take it as something to be calculated."""
    if not _UNIT.fullmatch(unit) or _NO_POWER.search(unit):
        raise ValueError(unit)


def convert(from_unit: str, unit: str) -> tuple[float, float]:
    """Scale and offset that take numbers in `from_unit` to numbers in `unit`: ``y = scale * x + offset``."""
    if from_unit == unit:
        return 1.0, 0.0
    import pint

    from_unit = from_unit.replace("·", "*")
    try:
        registry = _registry()
        _check(from_unit)
        zero, one = (
            float(registry.Quantity(x, from_unit or "dimensionless").to(unit or "dimensionless").magnitude)
            for x in (0.0, 1.0)
        )
    except pint.DimensionalityError as error:
        raise ValueError(f"[{from_unit}] cannot be converted to [{unit}]") from error
    except (pint.PintError, *_PARSER) as error:
        raise ValueError(f"[{from_unit[:80]}] is not a known unit, expected one of [{unit}]") from error
    _check_angle(from_unit, unit)
    return one - zero, zero


def is_unit(text: str) -> bool:
    """Whether a text names a unit, such as ``A``, ``rad/s`` or ``°C``."""
    import pint

    try:
        plain_dots = text.replace("·", "*")
        _check(plain_dots)
        _registry().Unit(plain_dots)
        return bool(text)
    except (pint.PintError, *_PARSER):
        return False


def quantity(unit: str, meaning: str, default: Any = ..., **bounds: Any) -> Any:
    """Declare a configuration field: a number in `unit`, with its meaning and its range (ge, gt, le, lt).

    >>> class Motor(Settings):
    ...     R: float = quantity("ohm", "phase resistance", gt=0)

    A text such as ``"1065 mohm"`` is converted (by `ema.core.config.Settings`). Without a bound of its own a quantity
    is within ± LARGEST.
    """
    if not bounds.keys() & {"le", "lt"}:
        bounds["le"] = LARGEST
    if not bounds.keys() & {"ge", "gt"}:
        bounds["ge"] = -LARGEST
    return Field(
        default,
        allow_inf_nan=False,
        description=f"{meaning} [{unit or '1'}]",
        json_schema_extra={"unit": unit},
        **bounds,
    )


def plain(value: Any) -> Any:
    """A number without a unit, where the unit is not known when a file is read; ValueError for a text with one."""
    try:
        return float(value) if isinstance(value, str) else value
    except ValueError:
        raise ValueError("a number without a unit is wanted here, in the effect's own unit (SI)") from None
