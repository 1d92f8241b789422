"""Data folders (dbc, config, systemd), found from an installed wheel as well as from the clone."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path


def _path(package: str, name: str) -> Path:
    return Path(str(files(package) / name))


def dbc(name: str = "ema.dbc") -> Path:
    """Path of a DBC file shipped with the project."""
    return _path("ema_dbc", name)


def config(name: str) -> Path:
    """Path of a configuration file shipped with the project."""
    return _path("ema_config", name)


def systemd(name: str) -> Path:
    """Path of a service file shipped with the project."""
    return _path("ema_systemd", name)
