"""The three-phase actuator with its measured cycles: simulate them at any point of parameters.

A *point* names faults (``"k1"``) and parameters of effects (``"cogging.amplitude"``); what it does not name is zero or
neutral. What a simulation gives is random (switching, sensor noise), so predictions are means over seeds.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cached_property

import numpy as np

from ema.core.names import FAULTS, PHASES
from ema.core.records import Array
from ema.discrepancy.actuator.reading.delays import see_delays
from ema.discrepancy.actuator.reading.features import Signals, delayed, features, floors, slices, stacked
from ema.discrepancy.actuator.reading.gear import Resonance
from ema.discrepancy.actuator.reading.measured import Measured
from ema.discrepancy.actuator.reading.sampling import straighten
from ema.discrepancy.actuator.reading.supply import resolve
from ema.discrepancy.plant import Point
from ema.effects import registry
from ema.models import hf
from ema.models.actuator import Actuator
from ema.models.layout import STATE

from .runs import Asked, Memory, Runs, Work

Steps = tuple[float, ...] | None  # None: the plant's
# [s] Integration steps of a mean, and of runs that tell the noise; of all, the nearest that divide a control period.
STEPS = (1e-6, 8e-7)
NOISE_STEPS = (1e-6, 5e-7, 8e-7, 2e-6)
CHUNK = 64  # runs that a thread has in memory at a time
CARRIED = 0.03  # [A] at the start, that tells that comparators are switching
ENVELOPE_STEP = 10  # the envelope is low-passed at 200 Hz: every tenth sample says all


def dividing(plant: Actuator, about: float) -> float:
    """The step nearest to `about` of which a whole number makes a control period. [s]"""
    T = 1.0 / plant.control.rate
    return T / round(T / about)


class EmaPlant:
    """Simulates the measured cycles of an actuator.

    Parameters
    ----------
    plant : Actuator
    data : Measured
    n_threads : int
    resonance : Resonance, optional
        Of the gear train, as rotor and user show it.
    """

    def __init__(self, plant: Actuator, data: Measured, n_threads: int = 2, resonance: Resonance | None = None):
        self.plant, self.data, self.n_threads, self.resonance = plant, data, n_threads, resonance
        self.work = Work()
        self.memory = Memory()
        self.step: float | None = None  # the one step that a record seems to have, where it was asked
        self.steps: tuple[float, ...] = STEPS
        self.noise_steps: tuple[float, ...] = NOISE_STEPS
        self.late = 0  # samples by which the recorded command is late against the other channels
        self.leaves_zero_open = data.zero is None
        self.n_motions = len(data.commands)
        of_motion = [np.flatnonzero(data.motion == m) for m in range(self.n_motions)]
        # Cycles with which columns are simulated: the first of each motion, or where temperature differs the farthest.
        self.first = [int(cycles[np.argmax(np.abs(data.dT[cycles]))]) for cycles in of_motion]
        groups = [features(plant, data.signals[c]) for c in self.first]
        self.slices = [slices(g) for g in groups]
        self.floors = [floors(g) for g in groups]
        supply = [at["supply"] for at in self.slices if "supply" in at]
        trusted = resolve(data, supply) if supply else None
        if trusted is not None:
            for floor, of in zip(self.floors, supply, strict=True):
                floor[of] = trusted

    @cached_property
    def delays(self) -> dict[str, float]:
        """Delays that the record shows, by effect. [s]"""
        return see_delays(self.plant, self.data)

    def neutral(self, name: str) -> float:
        """Value of a parameter that a point does not name: the plant file's own, or neutral."""
        if name in FAULTS:
            return 0.0
        effect, parameter = name.split(".")
        declared = self.plant.effects.get(effect, {})
        neutral = registry()[effect].neutral()[parameter]
        if name == "adc_saturation.limit":  # beyond the converter's range no limit makes a difference
            neutral = self.plant.sensors.adc_range
        return float(declared.get(parameter, neutral))

    def simulate(
        self, points: Sequence[Point], cycles: Sequence[int], seeds: Sequence[int], steps: Steps = None
    ) -> Runs:
        """One run for each (point, cycle, seed), given as three sequences of one length; all cycles last as long.

        Integration steps take turns with the seeds: what is rounded alike in every run with one step averages out.
        """
        taken = [dividing(self.plant, step) for step in steps or self.steps]
        named = {id(point): self._not_neutral(point) for point in points}
        asked = [
            Asked(named[id(point)], cycle, seed, taken[(seed - seeds[0]) % len(taken)], self.late, self.data.zero)
            for point, cycle, seed in zip(points, cycles, seeds, strict=True)
        ]
        new = sorted(self.memory.unknown(asked), key=lambda run: run.alike)
        jobs = [
            same[at : at + CHUNK]
            for same in ([run for run in new if run.dt == dt] for dt in dict.fromkeys(taken))
            for at in range(0, len(same), CHUNK)
        ]
        # One step often fills one batch of lanes only, which takes one core: the steps run side by side.
        with ThreadPoolExecutor(self.n_threads) as pool:
            for job, runs in zip(jobs, pool.map(self._simulated, jobs), strict=True):
                self.memory.keep(job, runs)
        self.work.asked += len(asked)
        self.work.simulated += len(new)
        self.work.steps += sum(self._n_steps(run) for run in new)
        return self.memory.recall(asked)

    def _n_steps(self, run: Asked) -> int:
        n_times = len(self.data.commands[self.data.motion[run.cycle]])
        return (n_times - 1) * round(1.0 / (self.plant.control.rate * run.dt))

    def _not_neutral(self, point: Point) -> frozenset[tuple[str, float]]:
        return frozenset((name, float(x)) for name, x in point.items() if x != self.neutral(name))

    def _simulated(self, runs: Sequence[Asked]) -> Runs:
        """Runs with one integration step."""
        points: list[Point] = [dict(run.point) for run in runs]
        return self._simulate(points, [run.cycle for run in runs], [run.seed for run in runs], runs[0].dt)

    def _simulate(self, points: Sequence[Point], cycles: Sequence[int], seeds: Sequence[int], dt: float) -> Runs:
        signals, envelope = self.signals(points, cycles, seeds, dt)
        return Runs(stacked(features(self.plant, signals)), envelope[:, ::ENVELOPE_STEP])

    def signals(
        self, points: Sequence[Point], cycles: Sequence[int], seeds: Sequence[int], dt: float
    ) -> tuple[Signals, Array]:
        """What is recorded in runs of as many points, cycles and seeds, and the envelopes (n, n_times). [A]

        The angle of the user, and the command with it, are free of what its sensor's zero is off by.
        """
        d = self.data
        zero_error = self.zero_error(points)
        zero = self._zero_of_user(zero_error)
        command = np.array([d.commands[d.motion[c]] for c in cycles]) + zero[:, None]
        recorded = command if d.every == 1 else np.array([d.signals[c].theta_cmd[0] for c in cycles]) + zero[:, None]
        cycles_ = np.asarray(cycles)
        k = np.array([[point.get(name, 0.0) for name in FAULTS] for point in points])
        k = np.clip(k + d.faults[cycles_], 0.0, 1.0)
        unseen = self.plant.sensors.lvdt_step * np.array([np.random.default_rng(s).random() - 0.5 for s in seeds])
        theta_m = d.start[cycles_, 1] - zero_error - self._wobble(points, cycles_)
        start = hf.start_at(self.plant, d.start[cycles_, 0] + zero + unseen, theta_m)
        start[:, STATE.index("w_m")] = d.speed[cycles_]
        start[:, STATE.index("w_u")] = d.user_speed[cycles_]
        holding = self.holding(points, cycles_)
        legs = self.legs(points, holding)
        for j, phase in enumerate(PHASES):  # the current that held it before
            start[:, STATE.index(f"s_{phase}")] = legs[:, j]
            for name in ("i", "lag1", "lag2"):
                start[:, STATE.index(f"{name}_{phase}")] = holding[:, j]
        r = hf.simulate(
            self.plant,
            k,
            delayed(command, -self.late),
            seeds=np.asarray(seeds),
            start=start,
            effects=self._effects(points),
            dT=d.dT[cycles_],
            dt=dt,
            n_threads=self.n_threads,
        )
        top = d.ranges[cycles_, None, None]
        r = replace(r, i=np.clip(r.i, -top, top))
        theta_m = r.theta_m
        if d.angle_noise:
            white = [np.random.default_rng([seed, 1]).standard_normal(theta_m.shape[1]) for seed in seeds]
            theta_m = theta_m + d.angle_noise * np.array(white)
        if d.angle_step:
            theta_m = d.angle_step * np.round(theta_m / d.angle_step)
        u_dc = r.u_dc if d.signals[cycles[0]].u_dc is not None else None
        theta_m, theta_u = (straighten(x, d.every) for x in (theta_m, r.theta_u))
        return Signals(r.i, theta_m, theta_u, recorded, u_dc), r.envelope

    def repeated(
        self, points: Sequence[Point], cycles: Sequence[int], n_seeds: int, seed: int, steps: Steps = None
    ) -> list[dict[int, Runs]]:
        """Runs of several cycles at several points, by cycle; each cycle has its own seeds, which all points share."""
        return self.each([(point, cycles) for point in points], n_seeds, seed, steps)

    def each(
        self, wanted: Sequence[tuple[Point, Sequence[int]]], n_seeds: int, seed: int, steps: Steps = None
    ) -> list[dict[int, Runs]]:
        """The same of several points with cycles of their own, all in the same batches of lanes."""
        found: list[dict[int, Runs]] = [{} for _ in wanted]
        n_times = [len(command) for command in self.data.commands]
        for length in sorted(set(n_times)):
            same = [
                (of, point, c)
                for of, (point, cycles) in zip(found, wanted, strict=True)
                for c in cycles
                if n_times[self.data.motion[c]] == length
            ]
            grid = [(point, c, seed + 1000 * c + j) for _, point, c in same for j in range(n_seeds)]
            if not grid:
                continue
            points, of_cycle, seeds = zip(*grid, strict=True)
            runs = self.simulate(points, of_cycle, seeds, steps)
            for at, (of, _, c) in enumerate(same):
                here = slice(at * n_seeds, (at + 1) * n_seeds)
                of[c] = Runs(runs.features[here], runs.envelopes[here])
        return found

    def means(
        self, points: Sequence[Point], cycles: Sequence[int], n_seeds: int, seed: int, steps: Steps = None
    ) -> list[dict[int, Array]]:
        """Mean features of several cycles at several points, by cycle."""
        found = self.repeated(points, cycles, n_seeds, seed, steps)
        return [{c: runs.features.mean(axis=0) for c, runs in at.items()} for at in found]

    def n_seeds(self, cycles: Sequence[int], at_least: int) -> int:
        """How many seeds of each of these cycles the lanes hold that `at_least` seeds need anyway."""
        at_once = hf.N_LANES * len(self.steps)
        n = at_once * -(-at_least * len(cycles) // at_once) // len(cycles)
        return n - n % len(self.steps)

    def _effects(self, points: Sequence[Point]) -> dict[str, dict[str, Array]]:
        names = sorted({name for point in points for name in point if "." in name})
        effects: dict[str, dict[str, Array]] = {}
        for name in names:
            effect, parameter = name.split(".")
            values = np.array([point.get(name, self.neutral(name)) for point in points])
            effects.setdefault(effect, {})[parameter] = values
        for effect, given in effects.items():  # `simulate` replaces a declared effect as a whole
            for parameter, value in self.plant.effects.get(effect, {}).items():
                given.setdefault(parameter, np.full(len(points), value))
        return effects

    def holding(self, points: Sequence[Point], cycles: np.ndarray) -> Array:
        """Phase currents at the start, shape (n, 3): those of the record less what sensors show too much. [A]"""
        shown = np.zeros((len(points), len(PHASES)))
        for effect in ("current_offset", "recorder_offset"):
            names = [f"{effect}.offset_{phase}" for phase in PHASES]
            shown += np.array([[point.get(name, self.neutral(name)) for name in names] for point in points])
        return np.asarray(self.data.holding[cycles] - shown + shown.mean(axis=1, keepdims=True))

    def legs(self, points: Sequence[Point], holding: Array) -> Array:
        """State of the three legs at the start, shape (n, 3), with the currents there.

        Within the comparators' band a motor at rest is without current, all legs alike, unless comparators that answer
        late go on switching as they had begun: then it carries what the controller asks for, and the record shows it.
        """
        name = "comparator_delay.time"
        late = np.array([p.get(name, self.neutral(name)) for p in points]) > 0.0
        switching = late & (np.abs(holding).max(axis=1) > CARRIED)
        return np.where(switching[:, None] & (holding < 0.0), -1.0, 1.0)

    def _zero_of_user(self, zero_error: Array) -> Array:
        """What the user's sensor reads too little if the rotor's is off by `zero_error`, for each run. [rad]

        Both together are what the record shows to lie between them. Where that is open, the user's sensor is right.
        """
        if self.data.zero is None:
            return np.zeros_like(zero_error)
        return self.data.zero - zero_error / self.plant.transmission.GR

    def zero_error(self, points: Sequence[Point]) -> Array:
        """By how much the zero of the recorded rotor angle is off, for each run. [rad]"""
        angle, apart = (
            np.array([p.get(name, self.neutral(name)) for p in points])
            for name in ("commutation_offset.angle", "commutation_offset.apart")
        )
        return np.asarray((angle - apart) / self.plant.motor.p)

    def _wobble(self, points: Sequence[Point], cycles: np.ndarray) -> Array:
        """What the resolver shows too much at the start of each run, beside its zero. [rad]"""
        error = np.zeros(len(points))
        law = registry()["resolver_error"]
        names = [f"resolver_error.{p.name}" for p in law.parameters]
        if any(name in point for point in points for name in names) or "resolver_error" in self.plant.effects:
            for run, (point, cycle) in enumerate(zip(points, cycles, strict=True)):
                values = [point.get(name, self.neutral(name)) for name in names]
                error[run] += law.laws["angle_error"](float(self.data.start[cycle, 1]), *values)
        return np.asarray(error)
