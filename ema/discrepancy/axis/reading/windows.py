"""Records cut into windows that are simulated on their own, each from a start state measured there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.ndimage import maximum_filter1d

from ema.core.errors import RecordError
from ema.core.records import Array, Cycle, Record
from ema.effects.base import T_REFERENCE
from ema.models.axis_config import Axis

from .channels import MIN_SAMPLES, Roles, find_runs, known_load, roles
from .jumps import measure_jumps
from .local_polynomials import left_of_noise, slope_of_noise, smooth
from .noise import ESTIMATE_UNCERTAINTY, Noise, estimate, is_derived
from .pushed import pushed
from .quiet_drive import quieten

HALF = 5  # samples on each side of a local quadratic
WIDTHS = (2 * HALF + 1, 7, 5)  # samples of one from which a window may begin: no wider than the motion lets it
GLITCH = 12.0  # noise amplitudes by which a step of position may miss the speed before the window is cut there
MAX_SAMPLES = 12_000  # of one record
STATIC_SAMPLES = 250
MIN_WINDOW = 16  # samples
TINY = 1e-300
AT_REST = 3.0  # noise amplitudes of the smoothed speed below which nothing is seen to move
SHORTEST_REST = 3  # samples
START_NOISE = 1.5 / np.sqrt(2 * HALF + 1)  # of a smoothed start state, per noise of one sample
STRETCH = 0.4  # [s] windows closer together are not independent enough to check one another
PER_CYCLE = 1_000_000  # stretches and parts that a cycle may have


@dataclass(frozen=True)
class Part:
    """Samples of one cycle from gap to gap, in arrays of shape (n_times,).

    Drive with less noise (`quiet_drive.py`; a share `left` of its variance is in it), what its `jumps` may do between
    samples (`jumps.py`), torque of a known load and position as recorded, position and speed to begin from; `number`
    is like no other part's of the record.
    """

    number: int
    t: Array
    drive: Array
    left: Array
    jumps: Array
    load: Array
    recorded: Array
    position: Array
    speed: Array


NO_PART = Part(-1, *(np.empty(0) for _ in range(8)))  # of readings at rest


@dataclass(frozen=True)
class Window:
    """Consecutive samples of one cycle, in arrays of shape (n_times,).

    `outputs` has one row per output channel of its record, `load` is the torque of a known load. `position`, `speed`
    are smooth; `static` windows hold samples at rest with the `direction` of approach. `course` is time and drive of
    the whole cycle. The window begins at sample `first` of its `part`, and the axis has moved in one direction since
    sample `earliest`.
    """

    group: str
    label: str
    t: Array
    drive: Array
    load: Array
    outputs: Array
    position: Array
    speed: Array
    dT: float
    static: bool = False
    direction: Array | None = None
    stretch: int = 0
    course: tuple[Array, Array] = (np.empty(0), np.empty(0))
    part: Part = NO_PART
    first: int = 0
    earliest: int = 0

    @property
    def cycle(self) -> int:
        """Number of the cycle it is from."""
        return self.stretch // PER_CYCLE

    @property
    def n(self) -> int:
        """Number of samples."""
        return len(self.t)

    @property
    def left(self) -> Array:
        """Share of the variance of the drive's noise that is left in the drive, shape (n_times,)."""
        return self.part.left[self.first : self.first + self.n]

    @property
    def period(self) -> float:
        """Median time between samples. [s]"""
        return float(np.median(np.diff(self.t)))

    def begin(self, n: int) -> int:
        """Sample of its part `n` before the window, if the axis was moving by then as it does in the window."""
        return max(self.first - n, min(self.earliest, self.first))

    def led_in(self, n: int) -> tuple[Array, Array, Array]:
        """Time, drive and known load of the window and up to `n` samples before it."""
        if n == 0:
            return self.t, self.drive, self.load
        rows = slice(self.begin(n), self.first + self.n)
        return self.part.t[rows], self.part.drive[rows], self.part.load[rows]

    def drive_by(self, clock: tuple[float, float], n: int = 0, acting: Array | None = None) -> Array:
        """The drive there, by a clock of its own (`clock_of_drive`): straight lines.

        `acting`: what acts of it at the samples of its part, where that is not what was recorded.
        """
        at, own, _ = self.led_in(n)
        off, late = clock
        if off == late == 0.0:
            return own if acting is None else acting[self.begin(n) : self.first + self.n]
        t, drive = self.course if acting is None else (self.part.t, acting)
        return np.interp(at, self.course[0][0] + (t - self.course[0][0]) * (1.0 + off) + late, drive)


@dataclass(frozen=True)
class Bench:
    """Windows of one record with its channels' roles and noise."""

    name: str
    roles: Roles
    noise: dict[str, Noise]
    windows: tuple[Window, ...]
    static: bool

    @property
    def load_noise(self) -> float:
        """Noise of one sample of a known load. [N m or N]"""
        return self.noise[self.roles.load].sigma if self.roles.load is not None else 0.0


def bench(plant: Axis, record: Record, name: str, length: float) -> Bench:
    """Cut one record into windows of about `length` seconds."""
    who = roles(plant, record)
    static = record.is_at_rest
    if static:  # readings at rest follow each other by number, not by time
        numbered = tuple(Cycle(c.number, {**c.channels, "t": np.arange(float(c.n_samples))}, c.label) for c in record)
        record = replace(record, cycles=numbered)
    if not static and who.position and who.speed and all(is_derived(c, who.position, who.speed) for c in record):
        who = replace(who, speed=None, outputs=tuple(c for c in who.outputs if c != who.speed), derived=who.speed)
    beside = [who.load] if who.load is not None else []
    seen = dict.fromkeys([who.drive, *beside] if static else [who.drive, *who.outputs, *beside])
    noise = {c: _noise(plant, record, c) for c in seen}
    if static and plant.drive != "current" and not plant.is_force:
        raise RecordError(
            f"{record.name}: a record at standstill needs drive: current with i_q [A], or a measured torque or force"
        )
    windows: list[Window] = []
    for cycle in record:
        if static:
            windows += _static(name, cycle, who)
        else:
            windows += _moving(plant, length, name, cycle, who, noise)
    if not windows:
        longest = max(cycle.n_samples for cycle in record)
        raise RecordError(
            f"{record.name}: too short: at least {MIN_SAMPLES} consecutive samples are needed, longest cycle {longest}"
        )
    return Bench(name, who, noise, _thin(windows), static)


def _noise(plant: Axis, record: Record, name: str) -> Noise:
    if name in plant.noise:
        return Noise(plant.noise[name], declared=True)
    x = [np.gradient(c[name], c["t"]) * c.period if name in ("theta_m", "q") else c[name] for c in record]
    size = float(np.sqrt(np.mean(np.square(np.concatenate(x)))))
    return estimate(record.cycles, name, record.resolution.get(name), size)


def _moving(plant: Axis, length: float, group: str, cycle: Cycle, who: Roles, noise: dict[str, Noise]) -> list[Window]:
    n = cycle.n_samples
    if n < MIN_SAMPLES:
        return []
    t = cycle["t"]
    dt = cycle.period
    width = 2 * HALF + 1
    gaps = np.flatnonzero(np.diff(t) > 5.0 * dt) + 1
    if who.position is not None:
        raw = cycle[who.position]
        smoothed = smooth(raw, gaps, width)
    speed, narrow = (
        smooth(cycle[who.speed], gaps, n) if who.speed is not None else smooth(raw, gaps, 2 * n - 1, dt)
        for n in (width, WIDTHS[-1])
    )
    if who.position is None:
        raw = smoothed = cumulative_trapezoid(speed, t, initial=0.0)
    warmer = cycle["temp_w"] - T_REFERENCE if "temp_w" in cycle else np.zeros(n)
    cuts = _glitches(cycle, who, noise) if who.position is not None and who.speed is not None else np.array([], int)
    margin = HALF if who.speed is not None else 2 * HALF  # over which the smoothed speed mixes rest with motion
    of_drive = pushed(plant, who.kind)[0] * noise[who.drive].rms(np.gradient(cycle[who.drive], t))
    jolted = of_drive * dt * np.sqrt(2 * margin + 1)  # one deviation of what its noise makes of a speed meanwhile
    seen = np.hypot(AT_REST * START_NOISE * speed_noise(who, noise, dt), jolted)
    still = np.abs(speed) < seen
    # An axis that stops for a moment and goes on the same way is smoothed to a slow one.
    off, of_noise = np.abs(speed - narrow), AT_REST * _narrow_noise(who, noise, dt)
    turning = maximum_filter1d(np.abs(np.diff(np.sign(speed), append=np.sign(speed[-1:]))), 2 * margin + 1) > 0.0
    still |= ~turning & (off > of_noise) & (np.abs(speed) < seen + off)
    rests = _rests(still | _reversals(speed), margin)
    turns = np.flatnonzero(np.diff(np.sign(speed)) != 0.0) + 1
    anew = np.unique(np.concatenate(([0], cuts, gaps, np.flatnonzero(still) + 1, turns)))  # what was before is no lead
    edges = np.unique(np.concatenate(([0], cuts, gaps, rests.ravel(), [n]))).astype(int)
    n_window = max(MIN_WINDOW, round(length / dt))
    out = []
    load = known_load(cycle, who.load)
    drive, left = quieten(t, cycle[who.drive], gaps, noise[who.drive])
    jumps = measure_jumps(t, cycle[who.drive], gaps, noise[who.drive])
    number = cycle.number * PER_CYCLE  # stretches and parts of different cycles are different
    starts = np.array([0, *gaps])
    started = _start_states(cycle, who, noise, gaps, (smoothed, speed))
    pieces = zip(*(np.split(x, gaps) for x in (t, drive, left, jumps, load, raw, *started)), strict=True)
    parts = [Part(number + start, *piece) for start, piece in zip(starts.tolist(), pieces, strict=True)]
    for a, b in pairwise(edges.tolist()):
        if any(start <= a < stop for start, stop in rests):
            continue
        n_parts = max(1, round((b - a) / n_window))
        for inside in np.array_split(np.arange(a, b), n_parts):
            if len(inside) < MIN_WINDOW:
                continue
            rows = slice(int(inside[0]), int(inside[-1]) + 1)
            outputs = np.stack([cycle[name][rows] for name in who.outputs])
            label = f"{group}, {cycle}, {t[rows][0]:.4g} s"
            stretch = number + int((t[rows][0] - t[0]) / max(STRETCH, length))
            given = (t[rows], drive[rows], load[rows], outputs)
            motion = (*given, smoothed[rows], speed[rows], float(np.mean(warmer[rows])))
            k = int(np.searchsorted(starts, a, side="right")) - 1
            earliest = anew[np.searchsorted(anew, rows.start, side="right") - 1]
            first, since = rows.start - int(starts[k]), int(earliest - starts[k])
            course, part = (t, drive), parts[k]
            out.append(
                Window(group, label, *motion, stretch=stretch, course=course, part=part, first=first, earliest=since)
            )
    return out


def _start_states(
    cycle: Cycle, who: Roles, noise: dict[str, Noise], gaps: NDArray[np.int_], smoothed: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Position and speed from which windows may begin, smoothed no wider than the motion is a local quadratic.

    A torque that varies within a few samples, as cogging of a light rotor, bends speed by more than its noise: what
    smoothing takes off it is no deviation that noise makes, and grows in the window.
    """
    position, speed = smoothed
    if who.position is not None:
        x, sigma = cycle[who.position], noise[who.position].rms(speed)
        position = smooth(x, gaps, _width(x, gaps, sigma, WIDTHS))
        if who.speed is None:
            speed = smooth(x, gaps, _width(x, gaps, sigma, tuple(2 * n - 1 for n in WIDTHS)), cycle.period)
    if who.speed is not None:
        x = cycle[who.speed]
        speed = smooth(x, gaps, _width(x, gaps, noise[who.speed].rms(np.gradient(speed, cycle["t"])), WIDTHS))
    return position, speed


def _width(x: Array, gaps: NDArray[np.int_], sigma: Array, widths: tuple[int, ...]) -> int:
    """The widest local quadratic that leaves no more than noise in most parts of a cycle, or the narrowest."""
    for width in widths[:-1]:
        left = (x - smooth(x, gaps, width)) / np.maximum(sigma, TINY)
        parts = np.array_split(left**2, max(1, len(x) // (4 * width)))
        of_noise = 1.0 - left_of_noise(width)
        if np.median([part.mean() for part in parts]) < (1.0 + ESTIMATE_UNCERTAINTY) ** 2 * of_noise:
            return width
    return widths[-1]


def speed_noise(who: Roles, noise: dict[str, Noise], period: float) -> float:
    """Noise of one sample of the speed; where it is derived, from that of the position."""
    return noise[who.speed].sigma if who.speed is not None else noise[str(who.position)].sigma / (HALF * period)


def _narrow_noise(who: Roles, noise: dict[str, Noise], period: float) -> float:
    """Noise of the speed as smoothed over the fewest samples."""
    if who.speed is not None:
        return noise[who.speed].sigma * float(np.sqrt(left_of_noise(WIDTHS[-1])))
    return noise[str(who.position)].sigma * slope_of_noise(2 * WIDTHS[-1] - 1, period)


def _rests(still: NDArray[np.bool_], margin: int) -> NDArray[np.int_]:
    """Begin and end of each rest with `margin` samples about it, shape (n_rests, 2).

    A window ends where the axis comes to rest and the next begins when it moves: when it breaks away depends on a
    torque of which the record has noisy samples, and what follows a breakaway at another moment is no noise.
    """
    runs = find_runs(still)
    rests = runs[runs[:, 1] - runs[:, 0] >= SHORTEST_REST]
    return np.clip(rests + np.array([-margin, margin]), 0, len(still))


def _reversals(speed: Array) -> NDArray[np.bool_]:
    """Samples about each reversal, where friction turns round over a way that no law here describes.

    Only where the stretches between reversals are long enough to stand alone; the first and the last may be lost.
    """
    turns = np.flatnonzero(np.sign(speed[1:]) != np.sign(speed[:-1])) + 1
    between = np.diff(np.concatenate(([0], turns, [len(speed)])))
    between[[0, -1]] = len(speed)
    out = np.zeros(len(speed), dtype=bool)
    for place, k in enumerate(turns):
        if min(between[place], between[place + 1]) >= 2 * MIN_WINDOW:
            out[max(k - SHORTEST_REST, 0) : k + SHORTEST_REST] = True
    return out


def _glitches(cycle: Cycle, who: Roles, noise: dict[str, Noise]) -> np.ndarray:
    """Samples before which the position moved by another amount than speed and time say (a lost sample)."""
    t, theta, w = cycle["t"], cycle[str(who.position)], cycle[str(who.speed)]
    dt = np.diff(t)
    mean = 0.5 * (w[1:] + w[:-1])
    miss = np.diff(theta) - mean * dt
    miss = miss - np.median(miss)
    spread = np.hypot(1.4826 * np.median(np.abs(miss)), noise[str(who.position)].rms(mean) * np.sqrt(2.0))
    return np.flatnonzero(np.abs(miss) > GLITCH * spread) + 1


def _static(group: str, cycle: Cycle, who: Roles) -> list[Window]:
    """Standstill map: each reading with the direction from which its angle was approached."""
    if who.position is None or cycle.n_samples < MIN_SAMPLES:
        return []
    theta, t = cycle[who.position], cycle["t"]
    # direction over about one hundredth of the map: readings at one angle scatter by the encoder's step
    span = max(HALF, cycle.n_samples // 400)
    smooth = np.convolve(np.pad(theta, span, mode="edge"), np.ones(2 * span + 1) / (2 * span + 1), mode="valid")
    direction = np.sign(np.gradient(smooth))
    direction[direction == 0.0] = 1.0
    out = []
    for k, part in enumerate(np.array_split(np.arange(len(t)), max(1, round(len(t) / STATIC_SAMPLES)))):
        rows = slice(int(part[0]), int(part[-1]) + 1)
        i = cycle[who.drive][rows]
        label = f"{group}, {cycle}, {theta[rows][0]:.3g} rad"
        columns = (t[rows], i, known_load(cycle, who.load)[rows], i[None, :], theta[rows], np.zeros(len(i)))
        out.append(Window(group, label, *columns, 0.0, True, direction[rows], cycle.number * PER_CYCLE + k))
    return out


def _thin(windows: list[Window]) -> tuple[Window, ...]:
    """Evenly spread windows of a long record, so that the time of a run stays bounded."""
    total = sum(w.n for w in windows)
    if total <= MAX_SAMPLES:
        return tuple(windows)
    stretches = list(dict.fromkeys(w.stretch for w in windows))
    keep = max(4, int(len(stretches) * MAX_SAMPLES / total))
    kept = {stretches[j] for j in np.unique(np.linspace(0, len(stretches) - 1, keep).round().astype(int))}
    return tuple(w for w in windows if w.stretch in kept)
