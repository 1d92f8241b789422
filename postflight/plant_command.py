"""`ema plant init`: the first plant file of a bench."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ema.core.ranges import FiniteRange

DRIVES = ("torque", "force", "i_q", "u_q", "duty", "w_ref", "current", "voltage", "speed-loop")


def _positive(unit: str | None = None) -> FiniteRange:
    return FiniteRange(min=0, min_open=True, unit=unit)


@click.group(short_help="Plant files: begin one from records and a data sheet.")
def plant() -> None:
    """Make the file that says what an actuator or an axis nominally is.

    \b
    Example:
      ema plant init bench.csv --kv 300 --out plant.yaml
    """


@plant.command(short_help="A commented plant file from records and a data sheet.")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--out", required=True, type=click.Path(path_type=Path), help="the plant file; must not exist")
@click.option("--name", default="bench", show_default=True, help="what to call it")
@click.option("--pole-pairs", type=click.IntRange(1, 200), help="data sheet")
@click.option("--slots", type=click.IntRange(1, 1000), help="of the stator, data sheet")
@click.option("--gear", type=_positive(), metavar="N", help="turns of the motor for one of the user, N:1")
@click.option("--torque-at", type=click.Choice(["motor", "load"]), help="side of the gear of the torque sensor")
@click.option("--measured-at", type=click.Choice(["motor", "load"]), help="side of the gear of position and speed")
@click.option("--R", "R", type=_positive("ohm"), metavar="OHM", help="phase resistance [ohm]")
@click.option("--L", "L", type=_positive("H"), metavar="H", help="phase inductance [H], or with its unit: 0.5mH")
@click.option("--kv", type=_positive("rpm/V"), metavar="RPM/V", help="speed constant, line to line [rpm/V]")
@click.option("--k-t", "k_t", type=_positive("N m/A"), metavar="N·m/A", help="torque per amplitude of current [N m/A]")
@click.option("--supply", "V_dc", type=_positive("V"), metavar="V", help="supply of which a duty cycle is a share [V]")
@click.option("--K-w", "K_w", type=_positive(), metavar="A·S/RAD", help="current per speed error of a loop [A s/rad]")
@click.option(
    "--drive", type=click.Choice(DRIVES), help="a channel, or what it is in the plant file, where several may"
)
@click.option("--brushed", is_flag=True, help="a DC motor with brushes: k_e = k_t, not that of one of three phases")
@click.option("--J", "J", type=_positive(), metavar="KG·M²", help="inertia or mass, where it is known [kg m^2, kg]")
def init(
    files: tuple[Path, ...], out: Path, name: str, pole_pairs: int | None, gear: float | None, **sheet: Any
) -> None:
    """Write a commented plant file: what you say is marked as such, what records show as fitted, the rest as a guess.

    Records with phase currents of a three-phase actuator make a file of `kind: ema`, all others one of `kind: axis`.

    \b
    Examples:
      ema plant init sine.csv rolling.csv --kv 300 --R 0.53 --pole-pairs 12 --out plant.yaml
      ema plant init positioner.csv --out plant.yaml
    """
    from ema.core.files import require_new, write_new
    from ema.core.records import each_once, read_record
    from ema.discrepancy.records import begin

    from .plant_file import actuator_file, axis_file

    require_new(out)
    found = [read_record(path) for path in each_once(files)]
    data = begin.Sheet(pole_pairs=pole_pairs, gear=gear, KV=sheet.pop("kv"), **sheet)
    is_actuator = all({"i_a", "i_b", "i_c", "theta_m"} <= set(record.channels) for record in found)
    text = actuator_file(found, data, name) if is_actuator else axis_file(found, data, name)
    write_new(out, text)
    click.echo(f"made {out}; what is marked 'a guess' wants your data sheet")
    click.echo(f"next: ema discrepancy --plant {out} {' '.join(map(str, files))} --out findings")
