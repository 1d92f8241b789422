"""`ema reproduce`: the paper's figures and table, with this project's beside them."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click


@click.command(short_help="The paper's figures 1-2 and table 1, with this project's beside them.")
@click.option("--out", required=True, type=click.Path(path_type=Path), help="folder of results, figures and page")
@click.option("--config", "config_path", type=click.Path(path_type=Path), help="builder YAML [default: the full one]")
@click.option("--workers", type=click.IntRange(1, 512), default=None, help="processes (default: one for each core)")
def reproduce(out: Path, config_path: Path | None, workers: int | None) -> None:
    """Build the bundle (DIR/bundle), run every experiment, write figures and reproduction.md.

    Each experiment's numbers are kept in DIR; an interrupted run goes on where it was when called again. Numbers of
    another bundle or of other software are not used again.

    \b
    Example:
      ema reproduce --out reproduction
    """
    import ema.bundle
    from ema.core import resources
    from ema.core.config import digest
    from ema.core.errors import ConfigError
    from ema.core.folders import make_folder
    from ema.core.version import version

    from . import build, experiments, reproduction_figures, reproduction_page
    from .config import Schedule
    from .executors import executor

    builder, plant = build.read(config_path or resources.config("builder.yaml"))
    builder = builder.model_copy(update={"schedule": Schedule()})  # the paper's, whatever else is in use
    make_folder(out)
    click.echo(f"seeds: builder {builder.seed}, experiments {experiments.SEED}", err=True)
    path = out / "bundle"
    if not path.exists():
        with executor(workers) as pool:
            build.build(builder, plant, path, pool, say=lambda text: click.echo(f"  {text}", err=True))
    bundle = ema.bundle.load(path)
    if bundle.manifest.get("builder_hash") != digest(builder):
        raise ConfigError(f"{path}: was built from another configuration; remove it or choose another --out")
    bench = experiments.Bench(bundle, workers or os.cpu_count() or 1)
    of = {"bundle": hashlib.sha256((path / "manifest.json").read_bytes()).hexdigest(), "software": version()}
    results = {name: stage(out, name, run, of) for name, run in _stages(bench).items()}
    reproduction_figures.draw(out, bundle, results)
    page = reproduction_page.page(bundle, results)
    (out / "reproduction.md").write_text(page, encoding="utf-8")
    click.echo(f"{out / 'reproduction.md'}")


def _stages(bench: Any) -> dict[str, Callable[[], dict[str, Any]]]:
    from . import experiments as e

    stages: dict[str, Callable[[], dict[str, Any]]] = {
        "models": lambda: e.models(bench),
        "bound": lambda: e.bound(bench),
        "qr": lambda: e.qr_cost(bench),
        "maps": lambda: e.maps(bench),
        "schedules": lambda: e.schedules(bench),
        "combined": lambda: e.combined(bench),
    }
    for method in e.METHODS:
        stages[f"identifier {method}"] = lambda method=method: e.identifiers(bench, method)  # type: ignore[misc]
    for method in e.OTHERS:
        stages[f"elsewhere {method}"] = lambda method=method: e.elsewhere(bench, method)  # type: ignore[misc]
    return stages


def stage(out: Path, name: str, run: Callable[[], dict[str, Any]], of: dict[str, str]) -> dict[str, Any]:
    """The experiment's numbers: from its file if it has been run with what `of` names, else run now."""
    file = out / f"{name.replace(' ', '_')}.json"
    try:
        done: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        if done["of"] == of:
            kept: dict[str, Any] = done["numbers"]
            return kept
    except (OSError, ValueError, KeyError, TypeError):  # not there, not finished, or of an earlier format
        pass
    click.echo(f"  {name}", err=True)
    result = run()
    unfinished = file.with_suffix(".part")
    unfinished.write_text(json.dumps({"of": of, "numbers": result}, indent=1), encoding="utf-8")
    os.replace(unfinished, file)
    return result
