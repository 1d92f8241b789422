"""The daemon's loop and its alarms for tests: shipped thresholds, states kept beside the log."""

from __future__ import annotations

from contextlib import contextmanager

from ema_daemon.alarming import AlarmDesk
from ema_daemon.health import Health
from ema_daemon.service import Service
from ema_daemon.state_file import StateFile
from ema_daemon.supervision import SupervisionSettings, promised
from ema_daemon.turn import Turn

from ema.alarms import AlarmSettings
from ema.bus import codec
from ema.core import config, resources
from ema.monitor.presence import Presence


@contextmanager
def desk(actuators, port, log, folder, **changes):
    """An AlarmDesk whose states are kept in `folder`; some settings changed."""
    shipped = config.load(resources.config("alarms.yaml"), AlarmSettings)
    settings = AlarmSettings.model_validate(shipped.model_dump() | changes)
    with StateFile(folder / "alarms.json") as state:
        yield AlarmDesk(settings, actuators, codec.default(), port, log, state)


@contextmanager
def loop(monitor, port, log, workers, folder, **changes):
    """The daemon's loop on a port, with shipped thresholds and deadlines; slower identifiers once a minute."""
    watch = SupervisionSettings()
    health = Health(monitor, port, log, promised(monitor.actuators, dict.fromkeys(workers, 60.0), [], watch))
    turn = Turn(Presence(codec.default(), monitor.actuators), port.name, 0.0, False)
    with desk(monitor.actuators, port, log, folder, **changes) as alarms:
        yield Service(monitor, port, log, codec.default(), workers, 0.0, health, watch, alarms, turn)
