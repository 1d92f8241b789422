"""What this configuration promises, as a table of deadlines, and what people are told when it does not happen."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from pydantic import Field, model_validator

from ema.core.config import Settings
from ema.core.status import Lapse
from ema.core.units import quantity
from ema.identification import METHODS
from ema.monitor import FIRST, Event, Level
from ema.monitor.supervision import Change, Promise, Supervisor

ALWAYS = float("inf")  # deadline of what is known at any time
LOOK = 0.25  # how often promises are looked at [s]
_MARGIN = 0.3  # what rests on something lapses a look later: the cause is told, not the consequence [s]
_ERRORS = {Lapse.BUS_DOWN, Lapse.BUS_OFF, Lapse.LOG}
_TOLD_ELSEWHERE = {Lapse.FRAMES}  # the counts themselves are an event
_BUS = (Promise(Lapse.BUS_DOWN), Promise(Lapse.BUS_OFF))
_TEXT = {  # what does not happen, and what is said when it does again
    Lapse.BUS_DOWN: ("the bus is down", "the bus is up again"),
    Lapse.BUS_OFF: ("the bus controller is bus-off", "the bus controller takes part again"),
    Lapse.ERROR_PASSIVE: ("the bus controller is error-passive", "the bus controller is error-active again"),
    Lapse.FLOODED: ("the bus is flooded with frames of others", "the flood of others' frames is over"),
    Lapse.LOG: ("the log is not written", "the log is written again"),
    Lapse.WORKER: ("its worker does not answer", "its worker answers again"),
    Lapse.SECOND_MONITOR: ("another monitor estimates the same actuator", "the other monitor is not heard any more"),
    Lapse.SILENT: ("nothing is heard of it", "it is heard again"),
    Lapse.NO_CYCLES: ("neither CycleStart nor CycleEnd comes", "cycles come again"),
    Lapse.NO_CURRENTS: ("PhaseCurrents do not come", "PhaseCurrents come again"),
    Lapse.NO_MOTION: ("Motion does not come", "Motion comes again"),
    Lapse.NO_SUPPLY: ("Supply does not come", "Supply comes again"),
    Lapse.CHANNEL: ("a channel reads what the actuator cannot do", "all channels are plausible again"),
    Lapse.NO_ESTIMATE: ("no usable estimate in time", "estimates in time again"),
}


class SupervisionSettings(Settings):
    """When something that the configuration promises is late."""

    silence: float = quantity("s", "an actuator that is on is heard more often than this", 1.0, gt=0, le=60)
    listen: float = quantity(
        "s", "so long another monitor, heard every second, is listened for at first", 1.4, ge=0, le=60
    )
    cycle: float = quantity("s", "test cycles of an actuator come more often than this", 1.7, gt=0, le=86400)
    age: dict[str, float] = Field(
        default={"linear": 1.0, "lf2": 2.0, "hf": 10.0},
        description="by identifier: an estimate sent longer than this after its cycle's last sample is late [s]",
    )

    @model_validator(mode="after")
    def _possible(self) -> SupervisionSettings:
        for method, age in self.age.items():
            if method not in METHODS:
                raise ValueError(f"age: identifier '{method}' is unknown; known: {', '.join(METHODS)}")
            if not 0 < age <= 86400:
                raise ValueError(f"age.{method} = {age!r} must be within 0…86400 s")
        return self

    def budget(self, method: str) -> float:
        """Age that an estimate may have. [s]"""
        return self.age.get(method, type(self)().age.get(method, 10.0))


def estimate_of(actuator: int, method: str) -> Promise:
    """The promise of usable estimates."""
    return Promise(Lapse.NO_ESTIMATE, actuator, method)


def worker_of(method: str) -> Promise:
    """The promise of a worker that answers."""
    return Promise(Lapse.WORKER, None, method)


def promised(
    actuators: Collection[int], slower: Mapping[str, float], remote: Collection[str], settings: SupervisionSettings
) -> Supervisor:
    """Everything that the configuration promises.

    Parameters
    ----------
    actuators : numbers
    slower : mapping of method to its period [s]
    remote : methods that run in a process of their own
    settings : SupervisionSettings
    """
    table = Supervisor()
    for lapse in (Lapse.BUS_DOWN, Lapse.BUS_OFF, Lapse.ERROR_PASSIVE, Lapse.FLOODED, Lapse.LOG, Lapse.FRAMES):
        table.promise(Promise(lapse), ALWAYS)
    for method in remote:
        table.promise(worker_of(method), ALWAYS)
    later, latest = settings.cycle + _MARGIN, settings.cycle + 2 * _MARGIN
    for n in actuators:
        silent, cycles = Promise(Lapse.SILENT, n), Promise(Lapse.NO_CYCLES, n)
        currents, channel = Promise(Lapse.NO_CURRENTS, n), Promise(Lapse.CHANNEL, n)
        table.promise(silent, settings.silence, _BUS)
        table.promise(cycles, settings.cycle, (*_BUS, silent))
        table.promise(currents, later, (*_BUS, silent, cycles))
        table.promise(Promise(Lapse.NO_MOTION, n), later, (*_BUS, silent, cycles))
        table.promise(Promise(Lapse.NO_SUPPLY, n), settings.silence + _MARGIN, (*_BUS, silent))
        table.promise(Promise(Lapse.SECOND_MONITOR, n), ALWAYS)
        table.promise(channel, ALWAYS, (*_BUS, silent, cycles, currents))
        grounds = (*_BUS, silent, cycles, currents, channel)
        table.promise(estimate_of(n, FIRST), latest, grounds)
        for method, every in slower.items():
            own = (worker_of(method),) if method in remote else ()
            table.promise(estimate_of(n, method), every + latest, (*grounds, estimate_of(n, FIRST), *own))
    return table


def event(change: Change, t_ns: int, detail: str = "") -> Event | None:
    """What a person is told of a change, once; None where another event says it with its counts."""
    promise = change.promise
    if promise.lapse in _TOLD_ELSEWHERE:
        return None
    code = promise.lapse.name.lower()
    subject = f"{promise.subject}: " if promise.subject else ""
    begun, over = _TEXT[promise.lapse]
    if change.lapsed:
        level = Level.ERROR if promise.lapse in _ERRORS else Level.WARNING
        return Event(t_ns, level, code, f"{subject}{begun}{detail}", promise.actuator)
    return Event(t_ns, Level.INFO, f"{code}_over", f"{subject}{over}, after {change.lasted:.1f} s", promise.actuator)
