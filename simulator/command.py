"""`ema simulate`."""

from __future__ import annotations

import os
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import click

from ema.core.ranges import FiniteRange

_BYTES_PER_SAMPLE = 9 * 8  # nine channels


@click.command(short_help="Simulated actuators whose faults grow, on the bus or as a record.")
@click.option("--scenario", "path", required=True, metavar="FILE", help="Scenario YAML.")
@click.option("--bus", metavar="BUS", help="Instead of the scenario's: auto, vcan0, udp_multicast, virtual:NAME …")
@click.option("--rate", type=FiniteRange(0, 1000, min_open=True), help="Scenario time over real time.")
@click.option("--cycles", "n_cycles", type=click.IntRange(min=1), help="Stop after so many test cycles.")
@click.option("--csv", "csv_path", metavar="FILE", help="Write the records to a CSV file; no bus.")
@click.option("--actuator", type=int, help="Which one to write with --csv, where the scenario has several.")
@click.option("--truth", metavar="FILE", help="Write the true faults of each cycle to a CSV file.")
def simulate(path: str, csv_path: str | None, actuator: int | None, truth: str | None, **options: Any) -> None:
    """Put simulated actuators on the bus: test motions at a period, faults that grow, noise, bad frames.

    Ends after the scenario's last cycle, or cleanly on SIGINT and SIGTERM.

    \b
    Examples:
      ema simulate --scenario config/scenario.yaml --bus vcan0 --truth truth.csv
      ema simulate --scenario config/scenario.yaml --cycles 20 --csv flight.csv
    """
    from . import scenario as scenarios
    from .truth import TruthFile

    _refuse_ignored(csv_path, actuator, **options)
    if csv_path is not None and truth is not None and Path(csv_path).resolve() == Path(truth).resolve():
        raise click.UsageError(f"--csv and --truth are the same file {csv_path}")
    scenario, plant = scenarios.load(path)
    scenario = scenarios.override(scenario, **options)
    numbers = [a.number for a in scenario.actuators]
    if csv_path is not None:
        lane = _lane(numbers, actuator)
        _refuse_record(scenario, plant, csv_path)
    with TruthFile(truth, numbers) if truth else nullcontext() as truth_file:
        on_cycle = truth_file.add if truth_file else lambda cycle: None
        if csv_path is not None:
            _to_csv(scenario, plant, lane, csv_path, on_cycle)
        else:
            _to_bus(scenario, plant, on_cycle)


def _refuse_ignored(csv_path: str | None, actuator: int | None, bus: str | None, rate: float | None, **_: Any) -> None:
    if csv_path is not None and (bus is not None or rate is not None):
        raise click.UsageError(f"--csv writes a file and no bus: {'--rate' if bus is None else '--bus'} has no meaning")
    if csv_path is None and actuator is not None:
        raise click.UsageError("--actuator says which one --csv writes: on a bus are all of them")


def _refuse_record(scenario: Any, plant: Any, path: str) -> None:
    """What would be found only after all cycles have been simulated."""
    from ema.core.csv_records import refuse_taken
    from ema.core.errors import ConfigError

    if scenario.n_cycles is None:
        raise ConfigError("a record needs an end: give the scenario n_cycles, or the command --cycles")
    refuse_taken(Path(path))
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    most = memory // 2 // (plant.n_samples * _BYTES_PER_SAMPLE)  # a record is written when it is whole
    if scenario.n_cycles > most:
        raise ConfigError(
            f"a record of {scenario.n_cycles} cycles does not fit into this machine's memory: at most {most}; "
            "put them onto a bus (without --csv), where there is no limit"
        )


def _lane(numbers: list[int], actuator: int | None) -> int:
    if actuator is None and len(numbers) == 1:
        return 0
    if actuator not in numbers:
        given = "none was chosen" if actuator is None else f"{actuator} is not one of them"
        raise click.UsageError(f"--csv writes one actuator; the scenario has {numbers} and {given} (--actuator)")
    return numbers.index(actuator)


def _to_csv(scenario: Any, plant: Any, lane: int, path: str, on_cycle: Any) -> None:
    from ema.bus import codec
    from ema.core.csv_records import write_csv
    from ema.core.records import Record

    from .injection import FaultSource
    from .node import cycles
    from .to_record import to_cycle

    written = []
    for cycle in cycles(scenario, plant, FaultSource(scenario, codec.default())):
        on_cycle(cycle)
        written.append(to_cycle(cycle, lane))
    write_csv(Record(tuple(written)), path)
    click.echo(f"{path}: {len(written)} cycles of actuator {scenario.actuators[lane].number}", err=True)


def _to_bus(scenario: Any, plant: Any, on_cycle: Any) -> None:
    import threading

    from ema.bus import codec
    from ema.bus.interface import open_bus
    from ema.core.stopping import on_stop

    from .node import run

    stop = threading.Event()
    on_stop(stop.set)

    def say(line: str) -> None:
        click.echo(line, err=True)

    with open_bus(scenario.bus, codec.default().filters("Tester"), role="Actuator") as port:
        say(port.choice)
        done = run(scenario, plant, port, codec.default(), stop, on_cycle=on_cycle, say=say)
    say(
        f"{done.n_cycles} cycles, {done.n_frames} frames sent, {done.n_refused} refused by the bus, "
        f"{done.n_injections} fault injections ({done.n_not_authentic} not authentic), "
        f"schedule moved {done.n_delays} times"
    )
