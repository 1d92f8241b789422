"""Simulated flights for `benchmarks/alarms.py`: what the monitor estimates in each cycle, kept in the cache.

Actuators differ from the bundle's by a spread: resistance, magnets' flux, inertia, drag and the three current sensors'
gains each by a share drawn from N(0, spread²). Each goes from cycle to cycle with the state it stopped in.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import platformdirs
from ema_simulator.fleet import Fleet
from ema_simulator.profile import FaultProfile, TemperatureProfile
from ema_simulator.scenario import ActuatorScenario, Faults, Scenario

from ema.bundle import Bundle
from ema.bus import codec
from ema.core.config import digest
from ema.core.names import FAULTS
from ema.core.status import Reason
from ema.identification.sampling import Sampler
from ema.monitor import FIRST, Identified, Job, Monitor, MonitorSettings, Runner, answered

SEED = 2611
N_LANES = 16
PERIOD = 1.0  # from one test cycle to the next [s]
EPOCH_NS = 1_700_000_000_000_000_000
SPREADS = (0.0, 0.005, 0.01, 0.02)
WARMING = 40.0  # of the windings over a flight [K]
N_HEALTHY = 340  # cycles
STEPS = (0.03, 0.06, 0.1, 0.2)
STEP_AT, N_STEP = 20, 80  # cycles
GROWTH, N_GROWTH = 0.2, 400  # from 0 to this in so many cycles
FAULTY_SPREAD = 0.005


@dataclass(frozen=True)
class Flight:
    """A batch of actuators, their faults over time, and the spread they are drawn with."""

    name: str
    n_cycles: int
    spread: float
    faults: tuple[tuple[str, tuple[tuple[float, float], ...]], ...] = ()  # of each lane: fault, points of its growth
    warming: float = 0.0


def healthy() -> Iterator[Flight]:
    """Nothing of k changes: 16 actuators of each spread, and 16 that warm up."""
    for spread in SPREADS:
        yield Flight(f"healthy-{spread:g}", N_HEALTHY, spread)
    yield Flight("healthy-warming", N_HEALTHY, 0.005, warming=WARMING)


def steps() -> Iterator[Flight]:
    """Each fault steps from 0, two actuators for each size."""
    lanes = [(f, ((STEP_AT - 1e-3, 0.0), (STEP_AT, size))) for f in FAULTS for size in STEPS for _ in range(2)]
    for n, begin in enumerate(range(0, len(lanes), N_LANES)):
        yield Flight(f"step-{n}", N_STEP, FAULTY_SPREAD, tuple(lanes[begin : begin + N_LANES]))


def growths() -> Iterator[Flight]:
    """Each fault grows linearly from 0, two or three actuators each."""
    lanes = [(FAULTS[n % 6], ((0.0, 0.0), (float(N_GROWTH), GROWTH))) for n in range(N_LANES)]
    yield Flight("growth", N_GROWTH, FAULTY_SPREAD, tuple(lanes))


def shortened(flights: Iterable[Flight], most: int | None) -> Iterator[Flight]:
    """Flights of at most so many cycles, under names of their own."""
    for flight in flights:
        yield flight if most is None else replace(flight, name=f"{flight.name}-{most}", n_cycles=most)


@dataclass(frozen=True)
class Flown:
    """What the monitor said: arrays of shape (n_cycles, n_lanes, …)."""

    k: np.ndarray
    sd: np.ndarray
    status: np.ndarray
    reasons: np.ndarray
    true: np.ndarray


def flown(flight: Flight, bundle: Bundle) -> Flown:
    """The flight's estimates, from the cache if it was flown before."""
    key = f"alarms-{SEED}-{digest(bundle.plant)[:12]}-{bundle.manifest['arrays']['A']['sha256'][:12]}"
    path = Path(platformdirs.user_cache_dir("ema")) / key / f"{flight.name}.npz"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(".part.npz")
        np.savez_compressed(part, **vars(_fly(flight, bundle)))
        part.replace(path)
    with np.load(path) as stored:
        return Flown(**{name: stored[name] for name in Flown.__dataclass_fields__})


def _fly(flight: Flight, bundle: Bundle) -> Flown:
    rng = np.random.default_rng([SEED, *flight.name.encode()])
    n = len(flight.faults) or N_LANES
    scenario = Scenario(
        seed=int(rng.integers(2**31)), period=PERIOD, actuators=tuple(_actuator(flight, lane, rng) for lane in range(n))
    )
    fleet, sampler = Fleet(scenario, bundle.plant), Sampler(bundle.plant, bundle.schedule)
    bundles = dict.fromkeys(range(n), bundle)
    monitor, runner = Monitor(bundles, codec.default(), MonitorSettings()), Runner(bundles)
    shape = flight.n_cycles, n
    k, sd, true = (np.full((*shape, 6), np.nan) for _ in range(3))
    status, reasons = np.zeros(shape, np.uint8), np.zeros(shape, np.uint32)
    for cycle in range(flight.n_cycles):
        true[cycle] = [a.faults.at(cycle * PERIOD) for a in scenario.actuators]
        r = fleet.next_cycle(true[cycle]).response
        missing = np.zeros(r.i.shape[-1], bool)
        for lane in range(n):
            measurement = sampler.measurement(r.i[lane], missing, r.theta_u[lane, 0], r.theta_m[lane, 0])
            t_ns = EPOCH_NS + round((cycle * PERIOD + bundle.plant.motion.duration) * 1e9)
            job = Job(t_ns, lane, cycle, FIRST, measurement, Reason(0))
            for out in answered(monitor.judge([job]), monitor, runner):
                if isinstance(out, Identified) and out.estimate.method == FIRST:
                    e = out.estimate
                    k[cycle, lane], sd[cycle, lane] = e.k, e.sd
                    status[cycle, lane], reasons[cycle, lane] = int(e.status), int(e.reasons)
    return Flown(k, sd, status, reasons, true)


def _actuator(flight: Flight, number: int, rng: np.random.Generator) -> ActuatorScenario:
    R, flux, J, C, *gains = flight.spread * rng.standard_normal(7)
    effects = {
        "winding_resistance": {"change": R, "per_kelvin": 0.0039},
        "magnet_flux": {"change": flux, "per_kelvin": -0.001},
        "inertia": {"change": J},
        "viscous_drag": {"coefficient": 3e-5 * C},
        "current_gain": dict(zip(("gain_a", "gain_b", "gain_c"), gains, strict=True)),
    }
    faults = {}
    if flight.faults:
        name, points = flight.faults[number]
        faults[name] = FaultProfile.model_validate([list(p) for p in points])
    heat = TemperatureProfile.model_validate([[0.0, 20.0], [flight.n_cycles * PERIOD, 20.0 + flight.warming]])
    return ActuatorScenario(
        number=number, faults=Faults(**faults), effects=effects if flight.spread else {}, temperature=heat
    )


if __name__ == "__main__":
    import time

    from .identification import quick_bundle

    bundle = quick_bundle()
    for flight in (*steps(), *growths(), *healthy()):
        began = time.perf_counter()
        flown(flight, bundle)
        print(flight.name, f"{time.perf_counter() - began:.0f} s", flush=True)
