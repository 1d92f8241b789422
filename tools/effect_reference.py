"""Write docs/effects.md from the library: `python tools/effect_reference.py`. A test says when it is out of date."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path

from ema.core.names import FAULTS
from ema.effects import registry
from ema.effects.base import Effect

PAGE = Path(__file__).resolve().parents[1] / "docs" / "effects.md"
PLANTS = {"ema": "actuator", "axis": "axis"}
PLACES = {"plant": "the plant", "loop": "a signal of the control loop", "recorder": "the recorder alone"}


def page() -> str:
    """The whole page."""
    return "\n".join(_lines(sorted(registry().values(), key=lambda effect: effect.name))) + "\n"


def _lines(effects: list[Effect]) -> Iterator[str]:
    yield "# Effects"
    yield ""
    yield "Written by `tools/effect_reference.py` from `ema/effects/`: change those files, not this one."
    yield ""
    yield "What `ema discrepancy` can name, and what a plant file may hold under `effects:` ([another plant](axis.md),"
    yield "[the actuator](discrepancy.md)). At the value in *off* a plant is as without the effect. What lies beyond"
    yield "*searched* may be written into a plant file, but is not looked for on an actuator; on an axis a search goes"
    yield "as far as the sizes in its records ask. `ema discrepancy --explain NAME` tells of one of them why it is not"
    yield "the answer. An indented line is what is simulated, as its file says it. On a linear axis read m for rad,"
    yield "N for N m and kg for kg m²; the user is what the output moves."
    for plant, name in PLANTS.items():
        own = [effect.name for effect in effects if plant in effect.plants]
        yield ""
        yield f"**Of an {name}** ({len(own)}): {', '.join(f'[{e}](#{e})' for e in own)}."
    for effect in effects:
        yield ""
        yield f"## {effect.name}"
        yield ""
        said, *more = (import_module(f"ema.effects.{effect.name}").__doc__ or "").strip().split("\n\n")
        said = said.replace("\n", " ")
        plants = " and ".join(PLANTS[plant] for plant in effect.plants)
        yield f"{said} Acts on {PLACES[effect.place]}; {plants}. Told from others by {effect.separated_by}."
        faults = [name for name in effect.mistaken_for if name in FAULTS]
        if faults and "ema" in effect.plants:
            yield f"A monitor without it would report {', '.join(faults)}."
        for paragraph in more:
            yield ""
            yield paragraph.replace("References\n----------\n", "*References.* ")
        if effect.is_table:
            yield "A table of values, of no known cause."
            continue
        for law in dict.fromkeys(_law(law) for law in effect.laws.values() if law.__doc__):
            yield ""
            yield f"    {law}"
        yield ""
        yield "| parameter | unit | off | searched | meaning |"
        yield "|---|---|---|---|---|"
        for p in effect.parameters:
            yield f"| {p.name} | {p.unit} | {p.neutral:g} | {p.low:g} … {p.high:g} | {p.meaning} |"


def _law(law: Callable[..., object]) -> str:
    """The equation that is simulated, and its sign."""
    return " ".join((law.__doc__ or "").split("\n\n")[0].split())


def main() -> None:
    """Write the page."""
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE)


if __name__ == "__main__":
    main()
