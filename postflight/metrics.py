"""`ema metrics`: the bus for Prometheus."""

from __future__ import annotations

import time
from pathlib import Path

import click

from ema.core.errors import Failure
from ema.core.ranges import FiniteRange


@click.command(short_help="The bus for Prometheus: estimates, alarms, heartbeat, counts.")
@click.option("--bus", default="auto", show_default=True, metavar="BUS", help="auto, vcan0, udp_multicast …")
@click.option("--listen", default="127.0.0.1", show_default=True, metavar="ADDRESS", help="Where it may be asked from.")
@click.option("--port", type=click.IntRange(0, 65535), default=9468, show_default=True, help="TCP; 0: any free one.")
@click.option("--pid", type=click.IntRange(min=1), help="Of the monitor, if it runs here: its memory as well.")
@click.option("--for", "seconds", type=FiniteRange(min=0), metavar="S", help="End after so long. [s]")
@click.option("--key-file", type=click.Path(path_type=Path), help="Of a bus whose frames are authenticated.")
def metrics(bus: str, listen: str, port: int, pid: int | None, seconds: float | None, key_file: Path | None) -> None:
    """Answer Prometheus at http://ADDRESS:PORT/metrics with what is on the bus, until Ctrl-C. It only listens.

    Nobody but this machine can ask, unless --listen says otherwise: the page is neither encrypted nor protected by a
    password. config/grafana-dashboard.json shows it in Grafana.

    \b
    Examples:
      ema metrics --bus vcan0
      ema metrics --bus vcan0 --listen 10.0.0.5 --port 9468 --pid $(systemctl show -P MainPID ema-daemon@vcan0)
    """
    import signal
    import threading

    from prometheus_client import CollectorRegistry, start_http_server

    from ema.bus import codec
    from ema.bus.interface import open_bus, parse

    from .exposition import Exposition

    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    registry = CollectorRegistry()
    exposition = Exposition(codec.default(), registry, time.time_ns, pid)
    end = time.monotonic() + (float("inf") if seconds is None else seconds)
    with open_bus(parse(bus).model_copy(update={"key_file": key_file})) as opened:
        try:
            server, thread = start_http_server(port, listen, registry)
        except OSError as error:
            raise Failure(f"{listen}:{port}: cannot be listened on ({error.strerror})") from error
        click.echo(f"{opened.choice}; http://{listen}:{server.server_port}/metrics", err=True)
        try:
            while not stop.is_set() and time.monotonic() < end:
                exposition.update(opened.read(0.1))
        finally:
            server.shutdown()
            server.server_close()
            thread.join()
