"""Slower identifiers at work: the same in the daemon's worker, in replay and in tests."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from ema.bundle import Bundle
from ema.identification import Estimate, Identifier, identifier

from .monitor import Monitor
from .outputs import Job, Output


class Runner:
    """Runs jobs; makes each identifier when it is first asked for.

    Parameters
    ----------
    bundles : mapping of actuator number to Bundle
    """

    def __init__(self, bundles: Mapping[int, Bundle]):
        self._bundles = bundles
        self._identifiers: dict[tuple[str, int], Identifier] = {}

    def run(self, job: Job) -> Estimate:
        """The estimate a job asks for."""
        bundle = self._bundles[job.actuator]
        key = job.method, id(bundle)
        if key not in self._identifiers:
            self._identifiers[key] = identifier(job.method, bundle)
        return self._identifiers[key].estimate(job.measurement)


def answered(outputs: Iterable[Output], monitor: Monitor, runner: Runner) -> Iterator[Output]:
    """Outputs with every job done at once and replaced by its answer.

    Given `Monitor.stream`, a job is answered before the next cycle is looked at, as it is on a live bus.
    """
    for output in outputs:
        if isinstance(output, Job):
            yield from monitor.conclude(output, runner.run(output))
        else:
            yield output


def answers(batches: Iterator[np.ndarray], monitor: Monitor, runner: Runner) -> Iterator[Output]:
    """All answers to recorded frames, in batches of any size, until they end."""
    for frames in batches:
        yield from answered(monitor.stream(frames), monitor, runner)
    yield from answered(monitor.finish(), monitor, runner)
