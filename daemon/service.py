"""The loop: bus → monitor → bus and log, with a heartbeat. Everything that decides is in the monitor."""

from __future__ import annotations

import sys
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping

import numpy as np

from ema.alarms import Command, Heard, Warmth, in_order
from ema.bus.codec import Codec
from ema.bus.port import MAX_BATCH, Port
from ema.core.errors import OccupiedError
from ema.core.frames import joined, overflow_notice
from ema.core.status import ServiceState
from ema.log import LogWriter
from ema.monitor import (
    ARBITER,
    Event,
    Identified,
    Job,
    Level,
    LostJob,
    Monitor,
    Output,
    SampledEnvelope,
    Timeliness,
    Verdict,
)

from .alarming import AlarmDesk
from .arrival import Arrival
from .ear import Ear
from .health import Health
from .identity import Identity
from .memory import settle
from .notify import notify
from .reload import Reloader
from .sinks import BusSink, LogSink
from .supervision import LOOK, SupervisionSettings
from .turn import Turn
from .voice import Voice
from .worker import Worker

BEAT = 1.0  # [s]
IDENTIFY = 10.0  # between two times that the software, the bundles and the configuration are told [s]
_WAIT = 0.05  # longest wait for frames, so that answers of workers and signals are seen [s]
_CYCLES_APART_NS = 250_000_000  # cycles of one actuator end farther apart
_LOOK_WAITS = 0.1  # at most so long, for a cycle's end [s]
_PACES = 3  # so many of them before a cycle should end, frames are no longer collected: one asleep, the rest for jitter
_SWITCH = 0.5e-3  # longest that another thread keeps the interpreter while this one wants it; Python's own is 5 ms [s]
_STUCK = 1.0  # a worker that has not answered for so long is not waited for [s]
_PATIENCE = 2.0  # for the workers at the end [s]


class Service:
    """Drives a monitor with a bus until `stop` is called.

    Parameters
    ----------
    monitor : Monitor
    port : Port
    log : LogWriter
    codec : Codec
    workers : mapping of identifier to Worker
    pace : float
        After a read that left nothing waiting, frames are collected for so long: fewer, larger batches cost less. Near
        a cycle's end they are taken as they come, and all work that can wait does, so that its answer is early. [s]
    health : Health
    watch : SupervisionSettings
    desk : AlarmDesk
    turn : Turn
    identity : Identity, optional
        What is told of the software, the bundles and the configuration; nothing without.
    ear : Ear, optional
        Who has listened to the port until the loop does.
    """

    def __init__(
        self,
        monitor: Monitor,
        port: Port,
        log: LogWriter,
        codec: Codec,
        workers: Mapping[str, Worker],
        pace: float,
        health: Health,
        watch: SupervisionSettings,
        desk: AlarmDesk,
        turn: Turn,
        identity: Identity | None = None,
        ear: Ear | None = None,
    ):
        self._monitor, self._port, self._log = monitor, port, log
        self._bus_sink, self._log_sink = BusSink(Voice(port, turn), codec), LogSink(log)
        self._workers, self._pace = workers, pace
        self._health, self._desk, self._turn = health, desk, turn
        self._arrival, self._timeliness = Arrival(), Timeliness(watch.budget)
        self._near = _PACES * pace
        self._later: list[Output | Verdict | Heard] = []  # answers of which the rest of the work is left to do
        self._later_ns = 0  # time of the first of them
        self._drops = 0
        self._asked_ns = 0  # time of the cycle that the arbiter has been asked about for longest
        self._stuck = False
        self._stopping = False
        self._identity, self._identified = identity, -np.inf
        self._ear = ear
        self._asked: deque[Callable[[], None]] = deque()

    @property
    def log(self) -> LogWriter:
        """The log that is written."""
        return self._log

    @property
    def desk(self) -> AlarmDesk:
        """Where alarms are raised."""
        return self._desk

    @property
    def identity(self) -> Identity:
        """What is told of the software, the bundles and the configuration."""
        assert self._identity is not None
        return self._identity

    def ask(self, what: Callable[[], None]) -> None:
        """Have the loop do something at its next turn; may be called from a signal handler."""
        self._asked.append(what)

    def tell(self) -> None:
        """An event with the state and every counter, for a person at the journal."""
        counters = ", ".join(f"{name} {count}" for name, count in self._health.counters.items() if count)
        self._event(Level.INFO, "state", f"{self._health.state.name.lower()}; {counters or 'nothing counted yet'}")

    def reload(self, reloader: Reloader) -> None:
        """Read the configuration again and say what came of it."""
        self._work_off()  # by the thresholds that held when it came
        taken, words = reloader.reload()
        if reloader.identity is not self._identity:
            self._identity, self._identified = reloader.identity, -np.inf  # told with the next heartbeat
        self._event(Level.INFO if taken else Level.WARNING, "reloaded" if taken else "reload_refused", words)

    def cut_log(self) -> None:
        """Finish the log's segment and begin another."""
        self._log.cut()
        self._event(Level.INFO, "log_cut", "the log begins a new segment")

    def stop(self) -> None:
        """End the loop at its next turn; may be called from a signal handler."""
        self._stopping = True

    def run(self) -> None:
        """Run until stopped; then finish what is begun."""
        next_beat = next_look = time.monotonic()
        started = next_look if self._ear is None else self._ear.since
        self._event(Level.INFO, "started", self._port.choice)
        self._desk.start(time.time_ns())
        settle()
        sys.setswitchinterval(_SWITCH)
        for at, frames in self._ear.end() if self._ear else ():
            self._turn.presence.without(frames, at)
        self._take_turn(time.monotonic(), time.monotonic() - started)
        while not self._stopping:
            frames = self._port.read(min(_WAIT, max(0.0, next_look - time.monotonic())))
            urgent = False
            if frames.size:
                self._ingest(frames)
                urgent = self._monitor.ends_within(self._near)
            while self._asked:
                self._asked.popleft()()
            if not urgent:
                self._work_off()
                self._answer_jobs(self._workers.values())
            now = time.monotonic()
            if now >= next_look + (_LOOK_WAITS if urgent else 0.0):
                self._take_turn(now, now - started)
                changed = self._look(now)
                next_look = max(next_look + LOOK, now)
                if self._turn.listening:
                    next_beat, next_look = now, min(next_look, started + self._turn.listen)
                elif now >= next_beat or changed:
                    self._beat(now - started)
                    next_beat = max(next_beat + BEAT, now) if now >= next_beat else next_beat
            if 0 < frames.size < MAX_BATCH // 2 and not urgent:
                time.sleep(self._pace)
        notify("STOPPING=1")
        self._finish(time.monotonic() - started)

    def _take_turn(self, now: float, uptime: float) -> None:
        """See whether another monitor is on the bus, and whether this one may speak."""
        turn, health = self._turn, self._health
        listening = turn.listening
        try:
            told = turn.look(now, uptime)
        except OccupiedError as error:
            self._event(Level.ERROR, "occupied", str(error))
            raise
        if told:
            self._event(Level.WARNING, *told)
        if listening and not turn.listening:
            notify("READY=1")
        health.standing_by = not turn.speaking and not turn.listening
        other = turn.presence.other(now) if turn.speaking else None
        health.contested = frozenset() if other is None else other.actuators

    def _ingest(self, frames: np.ndarray) -> None:
        if self._port.counters.kernel_drops != self._drops:
            self._drops = self._port.counters.kernel_drops
            frames = joined([overflow_notice(int(frames["t_ns"][0])), frames])
        now = time.monotonic()
        self._arrival.note(frames, time.time_ns(), now)
        self._log.frames(frames, self._port.name)
        frames = self._turn.presence.without(frames, now)
        if not frames.size:
            return
        self._settle(int(frames["t_ns"][-1]))
        self._put(in_order(self._desk.hear(frames), self._monitor.stream(frames)))

    def _settle(self, t_ns: int) -> None:
        """Have the arbiter's answer to a cycle before the next cycle: it decides how that is marked, live as in replay.

        On a live bus it is there long before; frames that come faster wait for it, but not for a worker that is stuck.
        """
        if self._later and t_ns - self._later_ns >= _CYCLES_APART_NS:
            self._work_off()
        worker = self._workers.get(ARBITER)
        if worker is None or worker.idle:
            self._stuck = False
            return
        if self._stuck or t_ns - self._asked_ns < _CYCLES_APART_NS:
            return
        end = time.monotonic() + _STUCK
        while not worker.idle and time.monotonic() < end:
            self._conclude(worker.answers())
            time.sleep(1e-3)
        self._stuck = not worker.idle

    def _put(self, outputs: Iterable[Output | Heard]) -> None:
        """Every estimate onto the bus as soon as it is there; the rest of the work is left for later."""
        for out in outputs:
            if not self._later:
                self._later_ns = out.t_ns
            if isinstance(out, Identified):
                self._later.append(self._send(out))
            self._later.append(out)

    def _work_off(self) -> None:
        """What is to be done with answers that are on the bus: log them, hand on their jobs."""
        later, self._later = self._later, []
        for item in later:
            if isinstance(item, Verdict):
                self._log_sink.estimate(item.out, item.age)
                if item.event:
                    self._log_sink.event(item.event)
            elif isinstance(item, Identified):
                self._desk.estimate(item)  # as the monitor made it, so that a replay gives the same alarms
            elif isinstance(item, Command | Warmth):
                self._desk.take(item)
            elif isinstance(item, SampledEnvelope):
                self._log_sink.envelope(item)
            elif isinstance(item, Event):
                self._log_sink.event(item)
            elif isinstance(item, Job):
                self._submit(item)

    def _send(self, out: Identified) -> Verdict:
        verdict = self._timeliness.judge(out, self._arrival.of(out.actuator, out.t_ns), time.monotonic())
        if verdict.to_bus:
            self._bus_sink.estimate(verdict.out, verdict.age)
        self._health.estimated(verdict.out, verdict.age)
        return verdict

    def _submit(self, job: Job) -> None:
        if job.method == ARBITER and self._workers[ARBITER].idle:
            self._asked_ns = job.t_ns
        if left := self._workers[job.method].submit(job):
            self._health.skipped(left)
            text = f"{left.method}: cycle {left.cycle} is skipped, the worker is behind"
            self._log_sink.event(Event(left.t_ns, Level.WARNING, LostJob.SKIPPED, text, left.actuator))

    def _answer_jobs(self, workers: Iterable[Worker]) -> None:
        for worker in workers:
            if not worker.idle:
                self._conclude(worker.answers())

    def _conclude(self, answers: Iterable[tuple]) -> None:
        for job, answer in answers:
            if isinstance(answer, Exception):
                self._health.failed(job)
                text = f"{job.method}: cycle {job.cycle} failed: {' '.join(str(answer).split()) or repr(answer)}"
                self._log_sink.event(Event(job.t_ns, Level.ERROR, LostJob.FAILED, text, job.actuator))
            else:
                self._put(self._monitor.conclude(job, answer))
        self._work_off()

    def _look(self, now: float) -> bool:
        """Look at the promises; whether the state has changed, which is told at once."""
        before = self._health.state
        for event in self._health.look(now, time.time_ns()):
            self._log_sink.event(event)
        return self._health.state is not before

    def _beat(self, uptime: float) -> None:
        now_ns = time.time_ns()
        for event in self._health.beat(now_ns):
            self._log_sink.event(event)
        self._send_beat(uptime, now_ns)
        notify("WATCHDOG=1")

    def _send_beat(self, uptime: float, now_ns: int) -> None:
        if self._identity is not None and uptime - self._identified >= IDENTIFY:
            self._identified = uptime
            self._bus_sink.identification(self._identity, now_ns)
        health = self._health
        self._bus_sink.heartbeat(health.heartbeat(uptime), health.supervision(), now_ns)
        lapses = health.supervisor.ordered
        self._desk.beat(self._log_sink.status(health.state, uptime, health.counters, lapses, now_ns))

    def _finish(self, uptime: float) -> None:
        self._put(self._monitor.finish())
        self._work_off()
        deadline = time.monotonic() + _PATIENCE
        for worker in self._workers.values():
            self._conclude(worker.close(deadline))
        self._health.beat(time.time_ns())
        self._health.state = ServiceState.STOPPING
        self._send_beat(uptime, time.time_ns())
        self._desk.close()
        self._event(Level.INFO, "stopped", f"stopped after {uptime:.1f} s, {self._monitor.n_cycles} cycles")

    def _event(self, level: Level, code: str, text: str) -> None:
        self._log_sink.event(Event(time.time_ns(), level, code, text))
