"""`ema hf-worker`: a process for the identifiers that need a compiler."""

from __future__ import annotations

from pathlib import Path

import click


@click.command("hf-worker", short_help="A process beside the daemon for the HF identifier.")
@click.option("--config", "config_path", required=True, type=click.Path(path_type=Path), help="the daemon's YAML")
@click.option(
    "--socket", "socket_path", type=click.Path(path_type=Path), help="instead of the configuration's remote.hf"
)
def hf_worker(config_path: Path, socket_path: Path | None) -> None:
    """Answer the daemon's jobs for the HF identifier until SIGTERM or SIGINT.

    It needs a compiler and more memory than the daemon may have, so it is a service of its own; if it fails or is
    behind, the daemon says so and goes on.

    \b
    Example:
      ema hf-worker --config /etc/ema/vcan0.yaml
    """
    import signal
    import threading

    from ema.core.errors import ConfigError
    from ema.core.status import Reason
    from ema.identification import Measurement
    from ema.monitor import Job

    from . import signals
    from .notify import notify
    from .settings import load, load_bundles
    from .worker_process import Server

    settings = load(config_path)
    path = socket_path or settings.remote.get("hf")
    if path is None:
        raise ConfigError(f"{config_path}: key 'remote.hf' is missing: the worker's socket (or give --socket)")
    bundles = load_bundles(settings)
    stop = threading.Event()
    nothing = dict.fromkeys((signal.SIGHUP, signal.SIGUSR1, signal.SIGUSR2), lambda: None)
    signals.decide({**dict.fromkeys(signals.STOPPING, stop.set), **nothing})
    server = Server(Path(path), bundles)
    server.prepare([Job(0, n, 0, "hf", Measurement.complete(b.i0[b.schedule]), Reason(0)) for n, b in bundles.items()])
    notify("READY=1")
    click.echo(f"listening on {path}", err=True)
    server.run(stop)
