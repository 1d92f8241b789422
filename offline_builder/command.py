"""`ema build`: the offline phase."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import click


@click.command(short_help="The offline phase: campaign, POD, schedule, A, LF2 library → bundle.")
@click.option("--config", "config_path", required=True, type=click.Path(path_type=Path), help="builder YAML")
@click.option("--out", required=True, type=click.Path(path_type=Path), help="folder of the bundle")
@click.option("--force", is_flag=True, help="replace a bundle of another configuration")
@click.option("--workers", type=click.IntRange(1, 512), default=None, help="processes (default: one for each core)")
@click.option("--scheduler", metavar="ADDRESS", help="a Dask cluster's, instead of this machine (extra: cluster)")
@click.option("--sign", "key_path", type=click.Path(path_type=Path), help="private Ed25519 key (PEM) to sign it with")
def build(
    config_path: Path, out: Path, force: bool, workers: int | None, scheduler: str | None, key_path: Path | None
) -> None:
    """Run the HF campaign and write the bundle the daemon works with.

    An interrupted build goes on where it was when called again. A bundle of another configuration or plant is not
    replaced without --force, and files that are no part of a bundle never are.

    \b
    Example:
      ema build --config config/builder-quick.yaml --out bundle
      ema build --config config/builder.yaml --out bundle --scheduler tcp://10.0.0.1:8786
      ema build --config config/builder.yaml --out bundle --sign builder.pem
    """
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from ema.core import terminal
    from ema.core.signatures import load_private

    from . import build as phase
    from .executors import executor

    key = None if key_path is None else load_private(key_path)
    builder, plant = phase.read(config_path)
    console = terminal.console(stderr=True)
    bar = Progress(
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), console=console
    )
    task = bar.add_task("HF runs", total=None)

    def progress(done: int, of: int) -> None:
        bar.start()  # not before it is known that the build can begin
        bar.update(task, completed=done, total=of)

    with ExitStack() as stack:
        stack.callback(lambda: bar.stop() if bar.live.is_started else None)  # else it would print an empty line
        pool = stack.enter_context(executor(workers, scheduler))
        made = phase.build(builder, plant, out, pool, progress, lambda text: console.print(f"  {text}"), force, key)
    figures = made.manifest["figures"]
    click.echo(
        f"{out}: {len(made.schedule)} points ({builder.schedule.method}), λ1 share {figures['lambda_1_share']:.4f}, "
        f"switching noise {1e3 * figures['noise_rms_A']:.2f} mA rms, {figures['n_runs']:.0f} runs, seed {builder.seed}"
    )
