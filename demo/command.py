"""`ema demo`: build, fly, watch, replay, show."""

from __future__ import annotations

from pathlib import Path

import click


@click.command(short_help="The whole chain on this machine: a growing fault is found, logged, replayed and shown.")
@click.option("--out", type=click.Path(path_type=Path), default=Path("ema-demo"), show_default=True, help="folder")
@click.option(
    "--bus", default="auto", show_default=True, help="auto: vcan0, else UDP multicast on loopback, else virtual"
)
@click.option("--cycles", "n_cycles", type=click.IntRange(2, 10_000), help="test cycles to fly  [default: 28]")
def demo(out: Path, bus: str, n_cycles: int | None) -> None:
    """Build a small bundle if there is none, put a simulated actuator on a bus, let faults grow in it, and watch.

    Everything goes to the output folder; what an earlier demo left there is replaced, but its bundle is used again. Any
    other folder that is not empty is refused.

    \b
    Example:
      ema demo --out ema-demo
    """
    from ema.core import terminal

    from . import chain, plot, results, stage

    console = terminal.console(stderr=True)
    files = stage.Files(out)
    files.prepare()
    chain.make_bundle(files, console)
    name, why = chain.choose_bus(bus)
    console.print(why)
    chain.write_configuration(files, name, n_cycles)
    chain.fly(files, name, console)
    flight = results.read(files)
    n_same = chain.replay(files)
    results.write_table(files, flight)
    plot.write(files.plot, flight)
    chain.make_report(files, console)
    terminal.console().print(results.table(flight))
    click.echo(f"replayed: all {n_same} estimates of the log are the same again, bit for bit")
    for path, meaning in files.made():
        click.echo(f"{meaning:<12} {path}")
