"""The daemon's configuration (config/daemon.yaml)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import yaml
from pydantic import Field, model_validator

from ema.alarms import AlarmSettings
from ema.bundle import Bundle, fingerprint
from ema.bundle import load as load_bundle
from ema.bus import codec
from ema.bus.identifiers import N_ACTUATORS
from ema.bus.interface import BusSettings
from ema.core import config, resources
from ema.core.config import Settings
from ema.core.errors import BundleError
from ema.core.signatures import load_trusted
from ema.core.units import quantity
from ema.identification import METHODS
from ema.log import LogSettings
from ema.models.actuator import Actuator
from ema.monitor import MonitorSettings

from .ear import located
from .sinks import estimate_message
from .supervision import SupervisionSettings

LOCAL = ("linear", "lf2")  # identifiers that are small enough for the daemon's own process
Number = Annotated[int, Field(ge=0, lt=N_ACTUATORS)]


class ActuatorSettings(Settings):
    """One monitored actuator. Paths are relative to the configuration's folder."""

    bundle: str = Field(min_length=1, description="folder written by `ema build`")
    plant: str | None = Field(default=None, description="the actuator's own file; a bundle made for another is refused")


class LogSection(LogSettings):
    """Where and how is logged."""

    directory: str = Field(min_length=1, description="must exist; relative to the configuration's folder")


class AlarmSection(Settings):
    """Where thresholds come from, and where the states of alarms are kept."""

    file: str | None = Field(default=None, description="alarms.yaml, relative to the configuration; absent: as shipped")
    state: str | None = Field(default=None, description="state file; absent: alarms.json in the log's directory")


class DaemonSettings(Settings):
    """The whole configuration."""

    bus: BusSettings = BusSettings()
    actuators: dict[Number, ActuatorSettings] = Field(min_length=1, description="by number on the bus")
    log: LogSection
    monitor: MonitorSettings = MonitorSettings()
    alarms: AlarmSection = AlarmSection()
    trusted_keys: list[str] = Field(
        default_factory=list, description="public Ed25519 keys (PEM): only bundles signed with one of them are taken"
    )
    remote: dict[str, str] = Field(
        default_factory=dict, description="identifiers in a process of their own (`ema hf-worker`): its Unix socket"
    )
    supervision: SupervisionSettings = SupervisionSettings()
    standby: bool = Field(
        default=False,
        description="beside another monitor of an actuator: listen, and take over when it is silent",
    )
    pace: float = quantity("s", "frames are collected for so long before they are looked at", 3e-3, ge=0, le=0.1)
    queue: int = Field(
        default=8, ge=1, le=1000, description="actuators whose newest cycle may wait for a slower identifier"
    )

    @model_validator(mode="after")
    def _somewhere_to_run(self) -> DaemonSettings:
        for method in self.monitor.slower:
            if method in METHODS and method not in LOCAL and method not in self.remote:
                raise ValueError(f"identifier '{method}' needs a process of its own: remote.{method} is its socket")
        idle = sorted(set(self.remote) - set(self.monitor.slower))
        if idle:
            raise ValueError(f"remote.{idle[0]} is never asked: monitor.slower does not name '{idle[0]}'")
        return self

    @model_validator(mode="after")
    def _can_be_told(self) -> DaemonSettings:
        messages = codec.default().messages
        told = [method for method in METHODS if estimate_message(method) in messages]
        for method in self.monitor.slower:
            if method in METHODS and method not in told:
                raise ValueError(
                    f"monitor.slower: the DBC has no message for estimates of '{method}', only of {', '.join(told)}"
                )
        return self


def text(settings: Settings) -> bytes:
    """A configuration as it is kept in the log."""
    return yaml.safe_dump(settings.model_dump(mode="json"), allow_unicode=True, sort_keys=False).encode()


def load(path: Path) -> DaemonSettings:
    """Read the configuration; its paths made absolute."""
    settings = config.load(path, DaemonSettings)
    folder = path.resolve().parent
    actuators = {
        number: one.model_copy(
            update={"bundle": str(folder / one.bundle), "plant": one.plant and str(folder / one.plant)}
        )
        for number, one in settings.actuators.items()
    }
    log = settings.log.model_copy(update={"directory": str(folder / settings.log.directory)})
    alarms = AlarmSection(
        file=settings.alarms.file and str(folder / settings.alarms.file),
        state=str(folder / settings.alarms.state) if settings.alarms.state else None,
    )
    remote = {method: str(folder / socket) for method, socket in settings.remote.items()}
    trusted = [str(folder / path) for path in settings.trusted_keys]
    return settings.model_copy(
        update={
            "trusted_keys": trusted,
            "bus": located(settings.bus, path),
            "actuators": actuators,
            "log": log,
            "alarms": alarms,
            "remote": remote,
        }
    )


def load_alarms(settings: DaemonSettings) -> AlarmSettings:
    """The thresholds; those shipped where the configuration names no file."""
    return config.load(settings.alarms.file or resources.config("alarms.yaml"), AlarmSettings)


def load_bundles(settings: DaemonSettings) -> dict[int, Bundle]:
    """The bundle of each actuator, one object for those of the same contents; BundleError where made for another."""
    trusted = [load_trusted(Path(path)) for path in settings.trusted_keys]
    loaded: dict[str, Bundle] = {}
    distinct: list[Bundle] = []
    bundles = {}
    for number, one in settings.actuators.items():
        if one.bundle not in loaded:
            bundle = load_bundle(one.bundle, trusted)
            alike = [other for other in distinct if other.manifest == bundle.manifest]  # hashes of the arrays included
            distinct += [] if alike else [bundle]
            loaded[one.bundle] = (*alike, bundle)[0]
        bundle = bundles[number] = loaded[one.bundle]
        if one.plant is not None and config.digest(config.load(one.plant, Actuator)) != config.digest(bundle.plant):
            raise BundleError(
                f"{one.bundle}: was made for actuator '{bundle.plant.name}' with other parameters than {one.plant}"
            )
    return bundles


def fingerprints(settings: DaemonSettings) -> dict[int, str]:
    """The hash of each actuator's bundle as it is on the disk now; BundleError where that would be refused."""
    trusted = [load_trusted(Path(path)) for path in settings.trusted_keys]
    found = {path: fingerprint(path, trusted) for path in {one.bundle for one in settings.actuators.values()}}
    return {number: found[one.bundle] for number, one in settings.actuators.items()}
