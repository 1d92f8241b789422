"""`ema inject`."""

from __future__ import annotations

import time
from pathlib import Path

import click

from ema.bus.authenticated import AuthenticatedPort
from ema.bus.identifiers import N_ACTUATORS
from ema.core.ranges import FiniteRange

_ASKS_WITHIN = 0.5  # a simulator looks at the bus every 50 ms, and answers at once [s]


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
    from ema.bus import codec, identifiers
    from ema.bus.header import N_SEQUENCES
    from ema.bus.interface import open_bus, parse
    from ema.bus.protection import Sender
    from ema.core.errors import BusError
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
    # Two frames with numbers from the clock: to a simulator that has heard an earlier call, the first one only says
    # that there is a new sender.
    values = {"k": [list(wanted.values())] * 2, "ramp_time": ramp}
    frames = codec.default().encode(MESSAGE, actuator, values)
    sender = Sender()
    sender.skip(identifiers.with_actuator(int(frames["id"][0]), actuator), time.time_ns() // 10**6 % N_SEQUENCES)
    with open_bus(parse(bus).model_copy(update={"key_file": key_file}), codec.default().filters("Tester")) as port:
        if port.write(sender.protect(frames)) < frames.size:
            raise BusError("; ".join(port.take_events()) or f"bus {port.name} does not take frames")
        if isinstance(port, AuthenticatedPort) and _asked(port):
            port.write(sender.protect(frames))  # what was sent before the answer has been refused
        click.echo(f"{port.choice}; sent to actuator {actuator}: {' '.join(faults) or 'no faults'}", err=True)


def _asked(port: AuthenticatedPort) -> bool:
    """Whether the simulator asks who this is, as it does when it has not heard of a tester before; it is answered."""
    end = time.monotonic() + _ASKS_WITHIN
    while not port.n_answers and time.monotonic() < end:
        port.read(0.05)
    return port.n_answers > 0


def _share(text: str, word: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 <= value <= 1.0:
        raise click.BadParameter(f"'{word}': must be a number within 0…1")
    return value
