"""The service put together from its configuration; everything that can be refused is refused here, before it starts."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from ema.bundle import Bundle
from ema.bus.codec import default
from ema.log import LogSettings, LogWriter
from ema.monitor import Monitor, Runner
from ema.monitor.presence import Presence

from .alarming import AlarmDesk
from .ear import Ear
from .health import Health
from .identity import ATTACHMENT, Identity
from .remote import RemoteRunner
from .service import Service
from .settings import DaemonSettings, load_alarms, load_bundles, text
from .state_file import StateFile
from .supervision import promised
from .turn import Turn
from .voice import Voice
from .worker import Worker


@contextmanager
def assembled(settings: DaemonSettings, ear: Ear | None = None) -> Iterator[Service]:
    """A service ready to run; afterwards bus and log are closed.

    Parameters
    ----------
    settings : DaemonSettings
    ear : Ear, optional
        The configuration's bus, if it is already open; taken over and closed.

    Raises
    ------
    ConfigError, BundleError, BusError, LogError
        One line each.
    """
    with ear or Ear(settings.bus) as listening:
        yield from _assembled(settings, listening)


def _assembled(settings: DaemonSettings, ear: Ear) -> Iterator[Service]:
    codec, port = default(), ear.port
    bundles = load_bundles(settings)
    alarm_settings = load_alarms(settings)
    configuration, thresholds = text(settings), text(alarm_settings)
    identity = Identity.of(bundles, configuration, thresholds)
    monitor = Monitor(bundles, codec, settings.monitor)
    local = Runner(bundles, [method for method in settings.monitor.slower if method not in settings.remote]).run
    bundles = {number: bundle.essence for number, bundle in bundles.items()}  # identifiers have what they need
    watch = settings.supervision
    presence = Presence(codec, monitor.actuators)
    remote = {
        method: RemoteRunner(path, bundles, patience=watch.budget(method)) for method, path in settings.remote.items()
    }
    attachments: dict[str, bytes | Path] = {
        codec.path.name: codec.path,
        "daemon.yaml": configuration,
        ATTACHMENT: identity.as_json(),
        "alarms.yaml": thresholds,
        **_manifests(bundles),
    }
    log_settings = LogSettings(**settings.log.model_dump(exclude={"directory"}))
    with ExitStack() as stack:
        log = stack.enter_context(LogWriter(settings.log.directory, attachments, log_settings))
        state = StateFile(Path(settings.alarms.state or Path(settings.log.directory) / "alarms.json"))
        stack.enter_context(state)
        turn = Turn(presence, port.name, watch.listen, settings.standby)
        desk = AlarmDesk(alarm_settings, bundles, codec, Voice(port, turn), log, state)
        for runner in remote.values():
            stack.enter_context(runner).watch()
        workers = {
            method: Worker(remote[method].run if method in remote else local, settings.queue, method)
            for method in settings.monitor.slower
        }
        every = {method: slower.every for method, slower in settings.monitor.slower.items()}
        supervisor = promised(bundles, every, remote, watch)
        answering = {method: runner.answers for method, runner in remote.items()}
        health = Health(monitor, port, log, supervisor, answering)
        yield Service(monitor, port, log, codec, workers, settings.pace, health, watch, desk, turn, identity, ear)


def _manifests(bundles: dict[int, Bundle]) -> dict[str, bytes]:
    """Manifests by name: one, or one for each actuator where their bundles differ."""
    texts = {number: json.dumps(b.manifest, indent=1, ensure_ascii=False).encode() for number, b in bundles.items()}
    if len(set(texts.values())) == 1:
        return {"manifest.json": next(iter(texts.values()))}
    return {f"manifest-{number}.json": text for number, text in texts.items()}
