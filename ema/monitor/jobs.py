"""Slower identifiers at work: the same in the daemon's worker, in replay and in tests."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping

import numpy as np

from ema.bundle import Bundle
from ema.identification import Estimate, Identifier, identifier

from .monitor import Monitor
from .outputs import Job, Output


class Runner:
    """Runs jobs; makes each identifier when it is first asked for, one for all actuators of a bundle.

    Parameters
    ----------
    bundles : mapping of actuator number to Bundle
    methods : names
        Identifiers that are made at once. Given any, there are no others, and the bundles are not kept.
    """

    def __init__(self, bundles: Mapping[int, Bundle], methods: Collection[str] = ()):
        self._identifiers: dict[tuple[str, int], Identifier] = {}
        self._keys = {number: id(bundle) for number, bundle in bundles.items()}
        self._bundles = {id(bundle): bundle for bundle in bundles.values()}
        for key in [(method, one) for method in methods for one in self._bundles]:
            self._made(*key)
        if methods:
            self._bundles = {}

    def run(self, job: Job) -> Estimate:
        """The estimate a job asks for."""
        return self._made(job.method, self._keys[job.actuator]).estimate(job.measurement)

    def _made(self, method: str, key: int) -> Identifier:
        if (method, key) not in self._identifiers:
            self._identifiers[method, key] = identifier(method, self._bundles[key])
        return self._identifiers[method, key]


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
