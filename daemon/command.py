"""`ema daemon`: the monitor as a service."""

from __future__ import annotations

from pathlib import Path

import click

# python-can and pint load these, and pandas with them, where they are installed: 80 MB that a monitor never uses.
UNUSED = ("asammdf", "dask")


@click.command(short_help="The monitor: bus → fault estimates on the bus and in the log.")
@click.option("--config", "config_path", required=True, type=click.Path(path_type=Path), help="daemon YAML")
@click.option("--bus", metavar="BUS", help="instead of the configuration's: auto, vcan0, udp_multicast …")
@click.option("--log", "log_path", metavar="DIR", help="instead of the configuration's log directory")
def daemon(config_path: Path, bus: str | None, log_path: str | None) -> None:
    """Watch the actuators on a bus until SIGTERM or SIGINT.

    SIGHUP reads the configuration again, SIGUSR1 begins a new segment of the log, SIGUSR2 tells the state in the
    journal, SIGQUIT the stacks of all threads.

    \b
    Example:
      ema daemon --config config/daemon.yaml --bus vcan0
    """
    import logging
    import signal
    import sys

    sys.modules.update(dict.fromkeys(UNUSED))  # type: ignore[arg-type]

    from ema.bus.interface import BusSettings, elsewhere

    from .ear import Ear, load_bus
    from .journal import use_journal

    logging.basicConfig(level=logging.INFO, format="%(levelname)s %(message)s")
    use_journal()

    def chosen(configured: BusSettings) -> BusSettings:
        return configured if bus is None else elsewhere(configured, bus)

    with Ear(chosen(load_bus(config_path))) as ear:
        # It listens for another monitor while all this, most of the start, is imported and read.
        from ema.core.errors import EmaError, Failure, OccupiedError

        from . import signals
        from .assembly import assembled
        from .reload import Reloader
        from .settings import DaemonSettings, load

        def read() -> DaemonSettings:
            settings = load(config_path)
            settings = settings.model_copy(update={"bus": chosen(settings.bus)})
            if log_path is not None:
                log = settings.log.model_copy(update={"directory": str(Path(log_path).resolve())})
                settings = settings.model_copy(update={"log": log})
            return settings

        settings = read()
        started = False
        try:
            with assembled(settings, ear) as service:
                reloader = Reloader(settings, read, service.log, service.desk, service.identity)
                signals.decide(
                    {
                        **dict.fromkeys(signals.STOPPING, service.stop),
                        signal.SIGHUP: lambda: service.ask(lambda: service.reload(reloader)),
                        signal.SIGUSR1: lambda: service.ask(service.cut_log),
                        signal.SIGUSR2: lambda: service.ask(service.tell),
                    }
                )
                started = True
                service.run()
        except OccupiedError:
            raise
        except EmaError as error:
            if started:  # so it is not of the configuration
                raise Failure(str(error)) from error
            raise
