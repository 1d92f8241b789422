"""Write docs/model.md from docstrings: `python tools/model_reference.py`. A test says when it is out of date."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ema import faults
from ema.effects import backlash, dry_friction, inverter, trapezoid
from ema.models import envelope, hf_kernel

PAGE = Path(__file__).resolve().parents[1] / "docs" / "model.md"

INTRODUCTION = """\
The equations of the three-phase actuator (`kind: ema`), for whoever writes a simulation of one and wants a record of it
to agree before anything is hidden in it. The numbers are the plant file's (`config/actuator.yaml` has each with its
unit and meaning); what an [effect](effects.md) adds is not here. A record that agrees is called adequate by `ema
discrepancy`; `ema simulate` makes one to lay beside yours."""

ORDER = """\
The controller works at `control.rate`: at each tick it samples the user's position (noise, then rounding to
`sensors.lvdt_step`), the rotor's angle and speed, which are exact, and the command, and holds its reference current
(one number, not three phases) until the next. In the same moment the record is taken. In between, in each step of a
microsecond, the rotor's angle decides which phases carry that current, and the comparators ask once whether a current
has left its band. On a bench they ask at no clock (`hf.simulate(located=True)` finds when); `ema discrepancy` takes
the step that fits the record, from 0.25 µs (no clock, or one as fast) to 20 µs. Recorded currents go through two
first-order stages of `sensors.f_lag` each, get noise of `sensors.current_noise` and are rounded to the converter's
step (`adc_range`, `adc_bits`); the comparators see them as they are. A cycle begins at rest."""

PARTS: tuple[tuple[str, str, tuple[Callable[..., Any], ...]], ...] = (
    (
        "Motor and inverter",
        "",
        (hf_kernel.electrical_step, trapezoid.trap, inverter.comparator),
    ),
    (
        "Control",
        "The reference current is commutated in six steps, by the rotor's electrical angle.",
        (hf_kernel.control, trapezoid.sector, trapezoid.six_step),
    ),
    ("Rotor, gear and user", "", (hf_kernel.mechanical_step, dry_friction.speed_after, backlash.follow)),
    ("The envelope", "What the monitor samples.", (envelope.envelope,)),
)


def page() -> str:
    """The whole page."""
    return "\n".join(_lines()) + "\n"


def _lines() -> Iterator[str]:
    yield "# The model"
    yield ""
    yield "Written by `tools/model_reference.py` from the docstrings of the code: change those, not this page."
    yield ""
    yield INTRODUCTION
    yield ""
    yield "## Faults"
    yield ""
    yield from _block(inspect.getdoc(faults) or "")
    for title, said, functions in PARTS:
        yield ""
        yield f"## {title}"
        if said:
            yield ""
            yield said
        for function in functions:
            yield ""
            yield f"`{function.__name__}` ({function.__module__}):"
            yield ""
            yield from _block((inspect.getdoc(function) or "").split("\n\nParameters\n")[0])
    yield ""
    yield "## What is sampled when"
    yield ""
    yield ORDER


def _block(text: str) -> Iterator[str]:
    yield "```"
    yield from text.splitlines()
    yield "```"


def main() -> None:
    """Write the page."""
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE)


if __name__ == "__main__":
    main()
