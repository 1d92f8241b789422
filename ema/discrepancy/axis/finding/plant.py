"""The axis and its records as the engine's `Plant`."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from functools import cached_property
from typing import Any

import numpy as np

from ema.core.records import Array, Record
from ema.discrepancy.axis.balance.records.course import courses
from ema.discrepancy.axis.balance.records.of_records import balance, plain_of
from ema.discrepancy.axis.balance.records.own_zeros import refine_zeros
from ema.discrepancy.axis.balance.regressing.found import Balance
from ema.discrepancy.axis.naming.naming import OF_MOTION, numbers_of
from ema.discrepancy.axis.reading.intake import take_in
from ema.discrepancy.axis.reading.lateness import see_delays
from ema.discrepancy.axis.reading.measured import Zero
from ema.discrepancy.axis.reading.noise import ESTIMATE_UNCERTAINTY
from ema.discrepancy.axis.reading.noisier import add_noise
from ema.discrepancy.axis.reading.undersampled import refuse_undersampled
from ema.discrepancy.axis.reading.windows import Bench, Window, bench
from ema.discrepancy.axis.scanning import structure
from ema.discrepancy.axis.scanning.zeros import zeros
from ema.discrepancy.axis.simulating.noise_model import measure_bounded, position_noise, whitener, without_start
from ema.discrepancy.axis.simulating.pack import Pack
from ema.discrepancy.axis.simulating.predictable import LONGEST_WINDOW, predictable_time
from ema.discrepancy.axis.simulating.whitening import Filter
from ema.discrepancy.plant import Block, Candidate, Errors, Fitted, Free, Point
from ema.discrepancy.verdict import BOUND, GROUPS
from ema.models import axis
from ema.models.axis_config import INSTANCE, LINES, Axis
from ema.models.axis_layout import row

from . import candidates, describe
from .screened import begin_with_what_shows, suggest_by_balance

NOISE = 3.0  # deviations of the position's noise that are no way
RUNAWAY = 1e6  # a window that runs away counts as no worse than this
SETTLED = 7.0  # time constants of a winding, by which 0.1 % is left of a current's beginning
N_AT_IMPACT = 5  # steps at least in a sample, where teeth may meet for one only
H_MAX = 2.5e-4  # [s] longest step of the simulation, unless the record's own period is longer than ten of them


class AxisPlant:
    """One axis with its records, cut into windows.

    Parameters
    ----------
    plant : Axis
    records : sequence of Record
    n_threads : int, optional
        Threads for batches of points; the result does not depend on it.

    Attributes
    ----------
    between : str
        What the recorded drive does between samples, a key of `ema.models.axis.BETWEEN`.
    """

    def __init__(self, plant: Axis, records: Sequence[Record], n_threads: int | None = None):
        self.plant = plant
        records = take_in(plant, records)
        for record in records:
            refuse_undersampled(plant, record)
        self.records = tuple(records)
        self.between = "straight"
        names = _distinct([r.source.stem if r.source else f"record {k + 1}" for k, r in enumerate(records)])
        self.n_threads = n_threads or min(os.cpu_count() or 1, 8)
        length = plant.window or LONGEST_WINDOW
        self._take([bench(plant, record, name, length) for record, name in zip(records, names, strict=True)])
        if plant.window is None:
            lengths = [predictable_time(self, b) for b in self.benches]
            self._take([bench(plant, *parts) for parts in zip(records, names, lengths, strict=True)])
        self.zeros: dict[str, Zero] = zeros(self)
        self.zeros = refine_zeros(self, courses(self), plain_of(plant))
        self._balances: dict[str, Balance | None] = {}
        self.plays: dict[tuple[object, ...], Array | None] = {}  # what `play_candidate` has found

    @property
    def balance(self) -> Balance | None:
        """The regression on the balance of torque, with the drive between samples as it is taken now."""
        if self.between not in self._balances:
            self._balances[self.between] = balance(self)
        return self._balances[self.between]

    @property
    def left_by_balance(self) -> float:
        """Mean square that the balance of torque leaves, over what noise makes of it; infinite where there is none."""
        of = self.balance
        return of.left / of.noise if of is not None and of.noise > 0.0 else np.inf

    def _take(self, benches: Sequence[Bench], filters: list[Filter | None] | None = None) -> None:
        self.benches = tuple(benches)
        self.windows: tuple[Window, ...] = tuple(w for b in benches for w in b.windows)
        self._bench_of = [b for b in benches for _ in b.windows]
        pairs = zip(self._bench_of, self.windows, strict=True)
        self.filters = filters or [None if w.static else whitener(self.plant, b, w) for b, w in pairs]
        self._packs: dict[tuple[int, ...], list[Pack]] = {}

    # ---- the engine's view -------------------------------------------------------------------------------------

    @cached_property
    def base(self) -> tuple[Free, ...]:
        """Friction, what the plant file says is to be fitted, and angle zeros that differ between records."""
        return candidates.base(self)

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """The windows."""
        cycles: dict[str, set[int]] = {}
        for w in self.windows:
            cycles.setdefault(w.group, set()).add(w.cycle)
        when = [(float(w.t[0]), float(w.t[-1])) if len(cycles[w.group]) == 1 else None for w in self.windows]
        return tuple(Block(w.group, w.stretch, of) for w, of in zip(self.windows, when, strict=True))

    @property
    def noise_uncertainty(self) -> float:
        """Zero where the plant file declares the noise of every channel that is compared; large where none has any."""
        return self.noise_uncertainties[0]

    @cached_property
    def noise_uncertainties(self) -> tuple[float, ...]:
        """The same for averages over samples."""
        if all(noise.declared for b in self.benches for noise in b.noise.values()):
            return (0.0,) * len(GROUPS)
        compared = [b.noise[name] for b in self.benches for name in (b.noise if b.static else b.roles.outputs)]
        if not all(noise.is_bound for noise in compared):
            return (ESTIMATE_UNCERTAINTY,) * len(GROUPS)
        pairs = zip(self._bench_of, self.windows, strict=True)
        bounded = [measure_bounded(self.plant, b, w, GROUPS) for b, w in pairs if not w.static]
        share = np.mean(bounded, axis=0) if bounded else np.ones(len(GROUPS))
        return tuple(np.hypot(ESTIMATE_UNCERTAINTY, BOUND * share).tolist())

    def residuals(self, points: Sequence[Point], blocks: Sequence[int]) -> list[list[Array]]:
        """Whitened residuals, clipped where a window runs away."""
        return self._map(lambda point: self.whitened(point, blocks), points)

    @property
    def noisier(self) -> AxisPlant | None:
        """The same with more of the drive's noise, where it shows any."""
        if self._noisier is not None:
            self._noisier.between = self.between
        return self._noisier

    @cached_property
    def _share_of_noise(self) -> float:
        """Of the noise's power as estimated by what is rough; a real torque may be rough too, which a balance shows.

        What the balance leaves holds all noise, and what laws are missing besides.
        """
        own = [b for b in (self.balance, *self._balances.values()) if b is not None and b.noise > 0.0]
        return min([1.0, *(b.left / b.noise for b in own)])

    @cached_property
    def _noisier(self) -> AxisPlant | None:
        noisy = [not b.static and not b.noise[b.roles.drive].is_bound for b in self.benches]
        if not any(noisy):
            return None
        other = copy(self)
        pairs = zip(self.benches, noisy, strict=True)
        share = self._share_of_noise
        other._take([add_noise(b, share) if is_noisy else b for b, is_noisy in pairs], self.filters)
        return other

    def candidates(self, point: Point, blocks: Sequence[int]) -> list[Candidate]:
        """Library effects with bounds and starts for this axis."""
        if self.is_linked:
            return []
        return [*candidates.library(self, point, blocks), *self._suggest(point)]

    def _suggest(self, point: Point) -> list[Candidate]:
        """What the balance needs, by the drive as it is taken now, and what else it needed as it was taken before.

        With the drive taken another way the balance may do without a law: then free runs must tell it from what fits
        as well, as a motor that saturates and friction by the square of its torque do. A law that it still needs is
        begun where it has it now: the same twice, a line of nearly the same order, would be its own rival.
        """
        ways = [self.balance, *(b for way, b in self._balances.items() if way != self.between)]
        found: list[Candidate] = []
        shown: set[str | None] = set()
        for b in ways:
            found += [c for c in suggest_by_balance(b, self.plant, point) if c.effect not in shown]
            shown |= {c.effect for c in suggest_by_balance(b, self.plant, {})}
        return found

    def seen_together(self, point: Point) -> list[Candidate]:
        """Effects that channels and the balance of torque show beside each other, begun where these have them."""
        library = {c.key: c for c in candidates.library(self, point, range(len(self.blocks)))}
        return begin_with_what_shows(self.balance, self.delays, self.plant, library)

    @cached_property
    def delays(self) -> dict[str, float]:
        """By how much the speed is late behind the position, or that behind the speed, in the first record. [s]"""
        roles, cycles = self.benches[0].roles, self.records[0].cycles
        moves = not self.benches[0].static and roles.position is not None and roles.speed is not None
        return see_delays(cycles, str(roles.position), str(roles.speed)) if moves else {}

    def structure(self, point: Point, blocks: Sequence[int]) -> list[Candidate]:
        """Terms that the torque residual along the measured motion suggests."""
        return [] if self.is_linked else structure.search(self, point, blocks)

    @property
    def is_linked(self) -> bool:
        """Whether a neighbour is declared, of which free runs know nothing: what would fit them best is no cause."""
        return self.balance is not None and bool(self.balance.given)

    def errors(self, point: Point, blocks: Sequence[int], fitted: Fitted | None = None) -> Errors:
        """Free-run error of the main output over its rms about the window's mean, pooled over records.

        The start state of each window is fitted to its first part: what is measured there is noisy, and no fault of the
        simulation. Nor is what noise made of parameters that were `fitted` to other windows, to first order.
        """
        squares: dict[str, list[tuple[float, float, float, int]]] = {}
        drifts = self._drifts(point, blocks, fitted)
        for j, r, drift in zip(blocks, self.free_run(point, blocks), drifts, strict=True):
            main = self.main_row(j)
            r, floor = without_start(self.plant, self._bench_of[j], self.windows[j], r)
            floor = floor + drift
            of = (float(np.mean(r[main] ** 2)), float(np.mean(floor[main])), self._power(j), self.windows[j].n)
            squares.setdefault(self.windows[j].group, []).append(of)
        shares, weight = [], 0.0
        for parts in squares.values():
            error, noise, power, n = np.array(parts).T
            shares.append((error @ n / (power @ n), noise @ n / (power @ n)))
            weight += float(power @ n)
        error, noise = np.sqrt(np.mean(shares, axis=0))
        return Errors(float(error), float(noise), weight)

    def is_of_sensor(self, candidate: Candidate) -> bool:
        """Whether it is of a sensor of the motion, beside which another is recorded."""
        return candidate.effect in OF_MOTION and any(len(b.roles.outputs) > 1 for b in self.benches)

    def free_run_errors(self, point: Point, blocks: Sequence[int]) -> list[Array]:
        """Error of the main output in each block, (n_times,), less its start's, over the root of its record's power."""
        of: dict[str, float] = {}
        for j, w in enumerate(self.windows):
            of[w.group] = of.get(w.group, 0.0) + self._power(j) * w.n
        runs = zip(blocks, self._less_start(point, blocks), strict=True)
        return [r[self.main_row(j)] / max(of[self.windows[j].group], 1e-300) ** 0.5 for j, r in runs]

    def _power(self, block: int) -> float:
        """Mean square of the main output, of a position about its mean."""
        w = self.windows[block]
        y = w.outputs[self.main_row(block)]
        is_position = not w.static and self._bench_of[block].roles.speed is None
        return float(np.var(y)) if is_position else float(np.mean(y**2))

    def _drifts(self, point: Point, blocks: Sequence[int], fitted: Fitted | None) -> list[Array]:
        """Variance that the fitted parameters' own makes of free runs, (n_channels, n_times) by block: diag J Σ Jᵀ"""
        if fitted is None or not fitted.free:
            return [np.zeros((1, 1))] * len(blocks)
        steps = [f.difference if f.high - point[f.name] >= f.difference else -f.difference for f in fitted.free]
        pairs = zip(fitted.free, steps, strict=True)
        points = [point, *({**point, f.name: point[f.name] + step} for f, step in pairs)]
        here, *moved = self._map(lambda p: self._less_start(p, blocks), points)
        found = []
        for k, own in enumerate(here):
            J = np.stack([(own - there[k]) / step for there, step in zip(moved, steps, strict=True)])
            found.append(np.einsum("icn,ij,jcn->cn", J, fitted.covariance, J))
        return found

    def _less_start(self, point: Point, blocks: Sequence[int]) -> list[Array]:
        pairs = zip(blocks, self.free_run(point, blocks), strict=True)
        return [without_start(self.plant, self._bench_of[j], self.windows[j], r)[0] for j, r in pairs]

    def describe(
        self, found: Sequence[Candidate], point: Point, draw: Callable[[int], Sequence[Point]]
    ) -> list[dict[str, Any]]:
        """Names, sentences and parameters of what was found."""
        return describe.effects(self, found, point, draw(400))

    def describe_structure(self, terms: Sequence[Candidate], point: Point) -> dict[str, Any]:
        """Unnamed terms in words and numbers."""
        return describe.structure(self, terms, point)

    # ---- simulation --------------------------------------------------------------------------------------------

    def model(self, point: Point) -> axis.Model:
        """The kernel's numbers at a point."""
        n = numbers_of(point)
        effects = {self._shifted(key): values for key, values in n.effects.items()}
        return axis.model(self.plant, effects, n.terms, **n.parameters)

    def _shifted(self, key: str) -> str:
        """Key of an effect beside the lines that the plant file has already."""
        name, _, number = key.partition(INSTANCE)
        have = sum(own.split(INSTANCE)[0] == name for own in self.plant.effects)
        return f"{name}{INSTANCE}{int(number or 1) + have}" if name in LINES and have else key

    def simulate(self, point: Point, blocks: Sequence[int]) -> list[Array]:
        """Outputs of each block as its record has them, shape (n_channels, n_times)."""
        model, zeros = self.model(point), numbers_of(point).zeros
        result: dict[int, Array] = {}
        for pack in self._pack(tuple(blocks)):
            result |= pack.split(self._simulate(pack, model, zeros))
        return [result[j] for j in blocks]

    def _simulate(self, pack: Pack, model: axis.Model, zeros: Mapping[str, float]) -> Array:
        zero = zeros.get(pack.bench.name, 0.0)
        if pack.direction is not None:
            return axis.holding(model, pack.position + zero, pack.direction, pack.t, pack.load)[None, :]
        step = _step(pack, model)
        led_in = pack.led_in(max(_late(model)) + (self._settling if pack.bench.roles.kind == "voltage" else 0.0))
        starts = self._starts(pack, model, step, led_in.n)
        starts[:, 0] += zero
        drive = pack.bench.roles.kind
        record = (led_in.offsets, led_in.t, pack.drive_by(model, led_in, self.between), starts)
        bristles, load = self._bristles(pack, model, led_in.n), led_in.load
        out = axis.simulate(model, drive, *record, step, pack.dT, pack.slide, self.between, bristles, load)
        out = out[:, led_in.own]
        out[0] -= zero
        return out[[_KERNEL_ROW[name] for name in pack.bench.roles.outputs]]

    @property
    def _settling(self) -> float:
        """How long a current shows how it began, where only its voltage is recorded. [s]"""
        return SETTLED * float(self.plant.L or 0.0) / float(self.plant.R) if self.plant.R else 0.0

    def free_run(self, point: Point, blocks: Sequence[int]) -> list[Array]:
        """Record less simulation, shape (n_channels, n_times) by block."""
        simulated = self.simulate(point, blocks)
        return [self.windows[j].outputs - y for j, y in zip(blocks, simulated, strict=True)]

    def whitened(self, point: Point, blocks: Sequence[int]) -> list[Array]:
        """Whitened residual of each block."""
        model, zeros = self.model(point), numbers_of(point).zeros
        result: dict[int, Array] = {}
        for pack in self._pack(tuple(blocks)):
            r = pack.outputs - self._simulate(pack, model, zeros)
            r = np.clip(np.nan_to_num(r, nan=RUNAWAY), -RUNAWAY, RUNAWAY)
            white = r / pack.bench.noise[pack.bench.roles.drive].sigma if pack.filter is None else pack.filter.whiten(r)
            result |= pack.split(np.clip(white, -RUNAWAY, RUNAWAY))
        return [result[j] for j in blocks]

    # ---- helpers -----------------------------------------------------------------------------------------------

    def bench_of(self, block: int) -> Bench:
        """The record a block belongs to."""
        return self._bench_of[block]

    @cached_property
    def _pool(self) -> ThreadPoolExecutor:
        return ThreadPoolExecutor(self.n_threads)

    def _map(self, f: Callable[[Point], list[Array]], points: Sequence[Point]) -> list[list[Array]]:
        if self.n_threads > 1 and len(points) > 1:
            return list(self._pool.map(f, points))
        return [f(point) for point in points]

    def _pack(self, blocks: tuple[int, ...]) -> list[Pack]:
        if blocks not in self._packs:
            by_bench: dict[str, list[int]] = {}
            for j in blocks:
                by_bench.setdefault(self.windows[j].group, []).append(j)
            self._packs[blocks] = [
                Pack(
                    self._bench_of[indices[0]],
                    indices,
                    [self.windows[j] for j in indices],
                    [f for j in indices if (f := self.filters[j]) is not None],
                )
                for indices in by_bench.values()
            ]
        return self._packs[blocks]

    def _starts(self, pack: Pack, model: axis.Model, step: float, n: int) -> Array:
        """True states `n` samples before the windows: the smoothed measurement, undone for what the model's sensors do.

        And the twist of a gear.
        """
        starts = np.zeros((len(pack.windows), 4))
        late_theta, late_w = _late(model)
        if pack.bench.roles.speed is None:
            late_w = late_theta
        for place, w in enumerate(pack.windows):
            k = w.begin(n)
            t, theta, speed = (x[k:] for x in (w.part.t, w.part.position, w.part.speed))
            starts[place, 0] = theta[0] if late_theta == 0.0 else np.interp(t[0] + late_theta, t, theta)
            starts[place, 1] = speed[0] if late_w == 0.0 else np.interp(t[0] + late_w, t, speed)
        derived = pack.bench.roles.speed is None
        starts[:, :2] = axis.true_state(model, starts[:, :2], derived=derived)
        if axis.is_flexible(model):
            offsets, t, *measured, drive, load, follows = pack.history(late_theta, n)
            theta, w = axis.true_state(model, np.column_stack(measured), derived=derived).T
            beyond = axis.beyond_after(
                model, pack.bench.roles.kind, offsets, t, theta, w, drive, follows, step, self.between, load
            )
            starts[:, 2:] = starts[:, :2] - beyond
        return starts

    def _bristles(self, pack: Pack, model: axis.Model, n: int) -> Array | None:
        """Share of friction that is built up `n` samples before windows, by the motion before that."""
        if not axis.has_memory(model):
            return None
        play = NOISE * position_noise(pack.bench, pack.windows[0])
        offsets, t, theta, w, _, _, follows = pack.history(_late(model)[0], n)
        return axis.bristles_after(model, offsets, t, theta, w, follows, play)

    def main_row(self, block: int) -> int:
        """Row of the output that is shown and whose error is reported."""
        who = self._bench_of[block].roles
        return who.outputs.index(who.speed) if who.speed in who.outputs and not self.windows[block].static else 0


def _step(pack: Pack, model: axis.Model) -> float:
    """Longest step of a simulation. [s]"""
    period = pack.windows[0].period
    return max(period / 10.0, min(period / N_AT_IMPACT if axis.has_play(model) else period, H_MAX))


def _late(model: axis.Model) -> tuple[float, float]:
    """By how much position and speed are late, by the clock of the record. [s]"""
    theta, w, rate = (
        float(model.z[row(name)]) for name in ("position_delay.time", "speed_delay.time", "clock_skew.rate")
    )
    return theta / (1.0 + rate), w / (1.0 + rate)


_KERNEL_ROW = {"theta_m": 0, "q": 0, "w_m": 1, "v": 1, "i_q": 2, "u_q": 3}


def _distinct(names: list[str]) -> list[str]:
    return [name if names.count(name) == 1 else f"{name} ({k + 1})" for k, name in enumerate(names)]
