"""`ema inject`."""

from __future__ import annotations

from pathlib import Path

import click

from ema.bus.identifiers import N_ACTUATORS
from ema.core.ranges import FiniteRange


@click.command(short_help="Tell a simulated actuator to grow faults.")
@click.argument("faults", nargs=-1, metavar="FAULT=VALUE…")
@click.option("--bus", default="auto", show_default=True, metavar="BUS", help="auto, vcan0, udp_multicast …")
@click.option("--actuator", type=click.IntRange(0, N_ACTUATORS - 1), default=0, show_default=True)
@click.option("--ramp", type=FiniteRange(0, 655), default=0.0, show_default=True, help="Time to get there [s].")
@click.option("--key-file", type=click.Path(path_type=Path), help="Of a bus whose frames are authenticated.")
def inject(faults: tuple[str, ...], bus: str, actuator: int, ramp: float, key_file: Path | None) -> None:
    """Send the faults a simulated actuator shall go to, each 0…1; those not named go to 0.

    Heard only by a simulator whose scenario says `allow_injection: true`; where its bus has a key file, only with the
    same key. Real actuators have no such thing.

    \b
    Example:
      ema inject k1=0.05 k3=0.2 --actuator 2 --ramp 10 --bus vcan0
    """
    from ema.bus import codec
    from ema.bus.commanding import Commander
    from ema.bus.interface import open_bus, parse
    from ema.core.names import FAULTS

    from .injection import MESSAGE

    given: dict[str, float] = {}
    for word in faults:
        name, _, value = word.partition("=")
        if name not in FAULTS:
            raise click.BadParameter(f"'{word}': the faults are {', '.join(FAULTS)}")
        if name in given:
            raise click.BadParameter(f"'{word}': {name} is given twice")
        given[name] = _share(value, word)
    wanted = dict.fromkeys(FAULTS, 0.0) | given
    with open_bus(parse(bus).model_copy(update={"key_file": key_file}), codec.default().filters("Tester")) as port:
        values = {"k": [list(wanted.values())], "ramp_time": ramp}
        Commander(port, codec.default()).send(MESSAGE, actuator, values)
        click.echo(f"{port.choice}; sent to actuator {actuator}: {' '.join(faults) or 'no faults'}", err=True)


def _share(text: str, word: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 <= value <= 1.0:
        raise click.BadParameter(f"'{word}': must be a number within 0…1")
    return value
