"""The monitor's first half: from frames to what identifiers see. Nothing here depends on an estimate.

So it may run in a process of its own and ahead of the second half (`Monitor.judge`), with the same result.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ema.bundle import Bundle
from ema.bus.codec import Codec
from ema.bus.protection import Counts
from ema.core.status import Reason

from .assembler import Assembler
from .cycles import AssembledCycle
from .outputs import FIRST, Event, Job
from .plausibility import Plausibility
from .settings import MonitorSettings


class Reception:
    """Cycles of all actuators on one bus, measured at their bundles' schedules.

    Parameters
    ----------
    bundles : mapping of actuator number to Bundle
    codec : Codec
    settings : MonitorSettings
    """

    def __init__(self, bundles: Mapping[int, Bundle], codec: Codec, settings: MonitorSettings):
        self._samplers = {number: bundle.sampler for number, bundle in bundles.items()}
        self._plausibilities = {number: Plausibility(bundle.plant) for number, bundle in bundles.items()}
        self._assembler = Assembler(codec, {number: b.plant for number, b in bundles.items()}, settings)

    @property
    def counts(self) -> Counts:
        """What happened to frames since the start."""
        return self._assembler.receiver.counts

    def ends_within(self, duration: float) -> bool:
        """See Monitor."""
        return self._assembler.ends_within(duration)

    @property
    def heard(self) -> dict[tuple[int, str], int]:
        """See Monitor."""
        return self._assembler.heard

    def feed(self, frames: np.ndarray) -> Iterator[Job | Event]:
        """Take frames in the order they were received, shape (n,): cycles as jobs for FIRST, and what was odd."""
        return map(self._measured, self._assembler.feed(frames))

    def finish(self) -> Iterator[Job | Event]:
        """No more frames will come: what is still open."""
        return map(self._measured, self._assembler.finish())

    def _measured(self, seen: AssembledCycle | Event) -> Job | Event:
        if isinstance(seen, Event):
            return seen
        sampler = self._samplers[seen.actuator]
        motion = seen.motion
        measurement = sampler.measurement(seen.i, seen.missing, motion["theta_u"][0], motion["theta_m"][0])
        reasons = seen.reasons
        if sampler.saturated(seen.i):
            reasons |= Reason.SATURATED
        reasons |= self._plausibilities[seen.actuator].reasons(seen.i, seen.missing, motion)
        return Job(seen.t_ns, seen.actuator, seen.span.cycle, FIRST, measurement, reasons)
