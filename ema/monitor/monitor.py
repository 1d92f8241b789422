"""The monitor: frames in, answers out. No I/O, no clock: driven alike by the live bus, by a log and by tests."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ema.bundle import Bundle
from ema.bus.codec import Codec
from ema.bus.protection import Counts
from ema.core.errors import ConfigError
from ema.core.names import FAULTS
from ema.core.status import IMPLAUSIBLE, Reason, Status
from ema.identification import METHODS, Estimate, Identifier, identifier
from ema.identification.fit import not_estimated
from ema.identification.noise import NoiseModel

from .doubt import ModelDoubt
from .outputs import FIRST, Event, Identified, Job, Level, Output, SampledEnvelope
from .reception import Reception
from .settings import MonitorSettings

ARBITER = "lf2"  # says whether residuals too large for FIRST are the model's fault or only its linearisation's
_DEGRADING = (
    Reason.LOST_FRAMES | Reason.SATURATED | Reason.START_STATE_UNKNOWN | Reason.MODEL_IN_DOUBT | Reason.OUT_OF_RANGE
    | Reason.AUTHENTICATION
)  # fmt: skip

_INVALIDATING = IMPLAUSIBLE | Reason.TWO_SPEAKERS  # and such a cycle says nothing of the model


class _Shared(NamedTuple):
    """What the actuators of one bundle have in common; none of it changes."""

    t: np.ndarray  # of the schedule [s]
    noise: NoiseModel
    identifier: Identifier


class _Channel:
    """What the monitor keeps of one actuator."""

    def __init__(self, shared: _Shared, settings: MonitorSettings):
        self.shared = shared
        self.doubts = {method: ModelDoubt(settings.model_check) for method in (FIRST, *settings.slower)}
        self.unseparable = dict.fromkeys(self.doubts, 0)  # estimates until it is told again
        self.chosen = dict.fromkeys(settings.slower, -1)  # interval of the last cycle chosen


class Monitor:
    """Estimates the faults of several actuators from the frames on one bus.

    Parameters
    ----------
    bundles : mapping of actuator number to Bundle
    codec : Codec
    settings : MonitorSettings

    Attributes
    ----------
    n_cycles, n_estimates : int
        Cycles closed, and those of them with an estimate that is valid or degraded.
    """

    def __init__(self, bundles: Mapping[int, Bundle], codec: Codec, settings: MonitorSettings):
        unknown = sorted(set(settings.slower) - (set(METHODS) - {FIRST}))
        if unknown:
            known = ", ".join(sorted(set(METHODS) - {FIRST}))
            raise ConfigError(f"monitor.slower: identifier '{unknown[0]}' is unknown; known: {known}")
        self._settings = settings
        shared = {id(b): _Shared(b.t[b.schedule], b.noise(FIRST), identifier(FIRST, b)) for b in bundles.values()}
        self._channels = {number: _Channel(shared[id(bundle)], settings) for number, bundle in bundles.items()}
        self._reception = Reception(bundles, codec, settings)
        self.n_cycles = self.n_estimates = 0

    @property
    def counts(self) -> Counts:
        """What happened to frames since the start."""
        return self._reception.counts

    @property
    def actuators(self) -> frozenset[int]:
        """Whose faults are estimated."""
        return frozenset(self._channels)

    def ends_within(self, duration: float) -> bool:
        """Whether, by the currents that a cycle lacks, one ends so soon that its answer is to be ready for. [s]"""
        return self._reception.ends_within(duration)

    @property
    def heard(self) -> dict[tuple[int, str], int]:
        """Good frames since the start, by actuator and message."""
        return self._reception.heard

    def update(self, frames: np.ndarray) -> list[Output]:
        """Take frames in the order they were received, shape (n,), FRAME_DTYPE; in batches of any size."""
        return list(self.stream(frames))

    def stream(self, frames: np.ndarray) -> Iterator[Output]:
        """As `update`, each answer as soon as it is found; to be exhausted before the next frames are given."""
        yield from self.judge(self._reception.feed(frames))

    def finish(self) -> list[Output]:
        """No more frames will come: close what is open."""
        return list(self.judge(self._reception.finish()))

    def conclude(self, job: Job, estimate: Estimate) -> list[Output]:
        """Take the answer to a job; those of one method in the order of their jobs."""
        return list(self._concluded(job, estimate))

    def judge(self, received: Iterable[Job | Event]) -> Iterator[Output]:
        """Answers to what a `Reception` gave, in its order; `stream` and `finish` do both halves."""
        for item in received:
            if isinstance(item, Job):
                yield from self._answer(item)
            else:
                yield item

    def _answer(self, job: Job) -> Iterator[Output]:
        channel = self._channels[job.actuator]
        if job.reasons & IMPLAUSIBLE:  # whatever it says would be of the sensor
            estimate = not_estimated(FIRST, job.measurement, Reason(0))
        else:
            estimate = channel.shared.identifier.estimate(job.measurement)
        outputs = list(self._concluded(job, estimate))
        self.n_cycles += 1
        usable = any(isinstance(o, Identified) and o.estimate.status <= Status.DEGRADED for o in outputs)
        self.n_estimates += usable
        yield from outputs
        yield _sampled(channel, job, estimate)
        if usable:
            yield from self._jobs(channel, job)

    def _concluded(self, job: Job, estimate: Estimate) -> Iterator[Output]:
        doubt = self._channels[job.actuator].doubts[job.method]
        usable = not (job.reasons | estimate.reasons) & _INVALIDATING
        changed = usable and doubt.update(job.cycle, estimate.p_value, estimate.unbounded)
        reasons = self._reasons(job, estimate)
        status = max(estimate.status, Status.DEGRADED if reasons & _DEGRADING else Status.VALID)
        status = status if usable else Status.INVALID
        yield Identified(job.t_ns, job.actuator, job.cycle, replace(estimate, status=status, reasons=reasons))
        if changed:
            yield _judgement(job, doubt, not self._has_last_word(job.method))
        if self._has_last_word(job.method) and self._is_newly_unseparable(job, estimate):
            yield _unseparable(job, estimate)

    def _has_last_word(self, method: str) -> bool:
        """Whether no other method will tell apart what this one cannot."""
        return method != FIRST or ARBITER not in self._settings.slower

    def _is_newly_unseparable(self, job: Job, estimate: Estimate) -> bool:
        """Whether faults cannot be told apart that could in all of the last cycles."""
        quiet = self._channels[job.actuator].unseparable
        before = quiet[job.method]
        if estimate.reasons & Reason.UNSEPARABLE:
            quiet[job.method] = self._settings.model_check.cycles
            return before == 0
        quiet[job.method] = max(before - 1, 0)
        return False

    def _reasons(self, job: Job, estimate: Estimate) -> Reason:
        """Reasons of estimate and cycle, with what the model check makes of them.

        Residuals too large for the linear model may only mean that a fault has left its range. So they are put down
        to that, until the arbiter, which follows faults farther, doubts the model too.
        """
        channel = self._channels[job.actuator]
        reasons = estimate.reasons | job.reasons
        if channel.doubts[job.method].doubted or channel.doubts[job.method].impossible:
            reasons |= Reason.MODEL_IN_DOUBT
        if job.method == FIRST and ARBITER in channel.doubts:
            if channel.doubts[ARBITER].doubted:
                reasons |= Reason.MODEL_IN_DOUBT
            elif reasons & Reason.MODEL_IN_DOUBT:
                reasons = reasons & ~Reason.MODEL_IN_DOUBT | Reason.OUT_OF_RANGE
        return reasons

    def _jobs(self, channel: _Channel, first: Job) -> Iterator[Job]:
        """The first usable cycle of every interval, by the frames' own time: live and replay choose the same.

        While cycles speak against the linear model, its arbiter is asked in each of them.
        """
        for method, slower in self._settings.slower.items():
            interval = first.t_ns // round(slower.every * 1e9)
            asked = method == ARBITER and bool(channel.doubts[FIRST].cycles)
            if interval != channel.chosen[method] or asked:
                channel.chosen[method] = interval
                yield replace(first, method=method)


def _sampled(channel: _Channel, job: Job, estimate: Estimate) -> SampledEnvelope:
    measured = np.where(job.measurement.valid, job.measurement.i_hat, np.nan)
    if np.isnan(estimate.k).any():
        sd = np.full(measured.shape, np.nan)
    else:
        sd = np.sqrt(np.diag(channel.shared.noise.covariance(job.measurement.start, estimate.k)))
    return SampledEnvelope(
        job.t_ns, job.actuator, job.cycle, channel.shared.t, measured, measured - estimate.residual, sd
    )


def _unseparable(job: Job, estimate: Estimate) -> Event:
    names = " or ".join(
        " with ".join(fault for fault, share in zip(FAULTS, direction, strict=True) if abs(share) > 0.3)
        for direction in estimate.unseparable
    )
    text = f"{job.method}: cycle {job.cycle} does not tell {names} from each other or from another cause"
    text += f"; to tell: ema discrepancy LOG --plant FILE --cycles {job.cycle},…"
    return Event(job.t_ns, Level.WARNING, "unseparable", text, job.actuator)


def _judgement(job: Job, doubt: ModelDoubt, arbitrated: bool) -> Event:
    if doubt.doubted:
        cycles = ", ".join(map(str, doubt.cycles))
        text = f"{job.method}: the residuals of cycles {cycles} are larger than the noise explains"
        if doubt.fits:
            text = f"{job.method}: cycles {cycles} read as less than no fault, or more than a complete one"
        if arbitrated:
            return Event(job.t_ns, Level.INFO, "beyond_linear", f"{text}; {ARBITER} is asked", job.actuator)
        text += f"; for the cause: ema discrepancy LOG --plant FILE --cycles {','.join(map(str, doubt.cycles))}"
        return Event(job.t_ns, Level.WARNING, "model_in_doubt", text, job.actuator)
    text = f"{job.method}: the noise explains the residuals again, last of cycle {job.cycle}"
    return Event(job.t_ns, Level.INFO, "model_trusted", text, job.actuator)
