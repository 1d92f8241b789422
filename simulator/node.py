"""The actuators as a bus node: every frame leaves at its absolute deadline."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ema.bus.codec import Codec
from ema.bus.port import Port
from ema.models.actuator import Actuator

from .disturb import disturb
from .fleet import CycleData, Fleet
from .injection import FaultSource
from .scenario import Scenario
from .traffic import Traffic

_MAX_WAIT = 0.05  # s, between looks at the bus
_MAX_LAG = 0.1  # s behind before the schedule is moved instead of caught up with
_SEED_BUS = 1 << 32  # stream of the seed for the bus, beside those of the actuators


@dataclass
class Summary:
    """What a run did."""

    n_cycles: int = 0
    n_frames: int = 0
    n_refused: int = 0  # frames the bus did not take
    n_delays: int = 0  # times the schedule had to be moved because this machine is too slow
    n_injections: int = 0
    n_not_authentic: int = 0  # fault injections that were refused


def cycles(scenario: Scenario, plant: Actuator, faults: FaultSource) -> Iterator[CycleData]:
    """The cycles of the scenario, the next one simulated while the caller is busy with the one before."""
    fleet = Fleet(scenario, plant)

    def simulate(number: int) -> CycleData:
        return fleet.next_cycle(faults.at(number * scenario.period))

    with ThreadPoolExecutor(1, thread_name_prefix="hf") as pool:
        number = 0
        pending: Future[CycleData] | None = pool.submit(simulate, 0)
        while pending:
            cycle = pending.result()
            number += 1
            more = scenario.n_cycles is None or number < scenario.n_cycles
            pending = pool.submit(simulate, number) if more else None
            yield cycle


def run(
    scenario: Scenario,
    plant: Actuator,
    port: Port,
    codec: Codec,
    stop: threading.Event,
    *,
    on_cycle: Callable[[CycleData], None] = lambda cycle: None,
    say: Callable[[str], None] = lambda line: None,
) -> Summary:
    """Put the scenario's actuators on the bus until it ends or `stop` is set.

    `on_cycle` is called as each cycle starts, `say` with one line when something happens to the bus.
    """
    summary = Summary()
    faults = FaultSource(scenario, codec)
    traffic = Traffic(codec, [a.number for a in scenario.actuators], scenario.stagger)
    bus_rng = np.random.default_rng([scenario.seed, _SEED_BUS])
    origin: float | None = None  # monotonic time of scenario time 0
    for cycle in cycles(scenario, plant, faults):
        frames, due = traffic.frames(cycle, scenario.period)
        frames, due = disturb(frames, due, cycle.number, scenario.disturbances, bus_rng)
        now = time.monotonic()
        start = now if origin is None else origin + cycle.t_start / scenario.rate
        if origin is None or now > start + _MAX_LAG:
            summary.n_delays += origin is not None
            origin = now - cycle.t_start / scenario.rate
            start = now
        deadlines = np.append(start + due / scenario.rate, start + scenario.period / scenario.rate)
        on_cycle(cycle)
        summary.n_cycles += 1
        sent = 0
        while sent <= frames.size and not stop.is_set():
            now = time.monotonic()
            upto = int(np.searchsorted(deadlines[:-1], now, side="right"))
            if upto > sent:
                n_taken = port.write(frames[sent:upto])
                summary.n_frames += n_taken
                summary.n_refused += upto - sent - n_taken
                sent = upto
            elif now >= deadlines[sent]:
                break  # the period is over
            else:
                faults.listen(port.read(0.0), (now - origin) * scenario.rate)
                for line in port.take_events():
                    say(line)
                stop.wait(min(_MAX_WAIT, deadlines[sent] - now))
        if stop.is_set():
            break
    summary.n_injections, summary.n_not_authentic = faults.n_injections, faults.n_refused
    return summary
