"""Facts of a record's clock and of each channel by itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from ema.core.names import CHANNELS
from ema.core.records import Array, Record
from ema.discrepancy.axis.reading.channels import find_runs, is_cut_off
from ema.discrepancy.axis.reading.noise import LEVELS, estimate, is_levelled, quantum

LONG = 1.5  # a step of time longer than so many median steps is a gap
HELD = 3  # samples in a row at a channel's end from which it is held there
# A parabola's top step lasts at most 1/(√2 - 1) = 2.4 times as long as the next one on both its sides; twice that.
PARABOLA = 2.0 / (np.sqrt(2.0) - 1.0)
POSITIONS = ("theta_m", "q", "theta_u", "theta_n")  # come to rest where they turn round, held by friction
COMMANDS = ("theta_ref", "q_ref", "theta_cmd", "w_ref")
DWELLING = (*COMMANDS, "u_q", "duty", "enabled")  # may dwell where they like, a drive also at its limit
ROUNDING = 1e-9  # of a channel's range: what writing it as text makes of a number that is exact
ENDS = 0.002  # share of a channel's samples at its end from which that is a limit, not a peak
BY_CHANCE = 1e-6  # probability of as many repeated rows in a record that lost none
CAUGHT_UP = 1.5  # times the step before: halfway from one that goes on (1) to one that makes up for a lost one (2)
HIGH = (0.6, 0.95)  # upper part of the spectrum, of half the sampling rate
FALLEN = 0.02  # power in that part, of all but the mean, below which a channel has fallen off [1]


@dataclass(frozen=True)
class Sampling:
    """The clock of a record.

    Attributes
    ----------
    n_cycles, n_samples : int
        Cycles, and samples of all of them.
    duration : float
        Of all cycles. [s]
    period : float
        Median step of time. [s]
    jitter : float
        Standard deviation of the steps that are no gaps, of the median. [1]
    n_gaps : int
        Steps longer than LONG medians.
    longest : float
        The longest step. [s]
    n_repeated : int
        Rows that repeat the one before in every measured channel, if more than chance makes: samples that were lost.
    """

    n_cycles: int
    n_samples: int
    duration: float
    period: float
    jitter: float
    n_gaps: int
    longest: float
    n_repeated: int


@dataclass(frozen=True)
class ChannelFacts:
    """One channel.

    Attributes
    ----------
    low, high : float
        Ends of what it takes. [unit]
    step : float
        Of its quantisation, 0 where there is none to see. [unit]
    noise : float
        rms at rest, estimated from what neighbouring samples cannot agree on. [unit]
    held : float
        Share of its samples that lie in a row at one of its ends: clipped, or a limit. [1]
    is_constant : bool
    upper : float
        Share of its power in the upper part of the spectrum, without its noise: what is sampled too slowly does not
        fall off. [1]
    """

    name: str
    unit: str
    low: float
    high: float
    step: float
    noise: float
    held: float
    is_constant: bool
    upper: float


def sampling(record: Record) -> Sampling:
    """The record's clock."""
    steps = np.concatenate([np.diff(cycle["t"]) for cycle in record.cycles])
    period = float(np.median(steps)) if steps.size else np.nan
    regular = steps[steps <= LONG * period]
    return Sampling(
        record.n_cycles,
        sum(cycle.n_samples for cycle in record.cycles),
        float(sum(np.ptp(cycle["t"]) for cycle in record.cycles)),
        period,
        float(np.std(regular) / period) if regular.size else np.nan,
        int(np.sum(steps > LONG * period)),
        float(steps.max()) if steps.size else np.nan,
        count_repeated(record),
    )


def count_repeated(record: Record) -> int:
    """Rows that repeat the one before in every measured channel, 0 where as many do by chance.

    Looked at is the channel that stays least often as it was, where it moves before and after: as often as the others
    stay at any time, they stay there by chance. A position that was lost catches up; one that goes from count to count
    does not, and what a controller makes of it stays with it.
    """
    names = [name for name in record.channels if name not in ("t", *COMMANDS)]
    stays = [np.array([np.diff(cycle[name]) == 0.0 for name in names]) for cycle in record.cycles]
    share = [float(np.mean(np.concatenate([of[j] for of in stays]))) for j in range(len(names))]
    moving = [j for j, of in enumerate(share) if of < 1.0]
    if len(moving) <= 1:  # there is nothing for it to be lost with
        return 0
    least, *others = sorted(moving, key=lambda j: share[j])
    n, alone, together, free = 0, 0, 0, 0
    before, after = 0.0, 0.0  # by how much positions change about what repeats
    positions = [names[j] for j in moving if names[j] in POSITIONS]
    for cycle, of in zip(record.cycles, stays, strict=True):
        own, rest = of[least], np.asarray(np.all(of[others], axis=0))
        changes = [np.abs(np.diff(cycle[name])) for name in positions]
        once = own[1:-1] & ~own[:-2] & ~own[2:]
        for change in changes:
            once &= (change[:-2] > 0.0) & (change[2:] > 0.0)
        repeats = once & rest[1:-1]
        n += int(repeats.sum())
        before += sum(float(change[:-2][repeats].sum()) for change in changes)
        after += sum(float(change[2:][repeats].sum()) for change in changes)
        alone += int(once.sum())
        together += int((rest & ~own).sum())
        free += int((~own).sum())
    if positions and after < CAUGHT_UP * before:
        return 0
    by_chance = alone * together / max(free, 1)
    return n if stats.poisson.sf(n - 1, by_chance) < BY_CHANCE else 0


def channels(record: Record) -> list[ChannelFacts]:
    """Every channel but time."""
    return [_channel(record, name) for name in record.channels if name != "t"]


def _channel(record: Record, name: str) -> ChannelFacts:
    parts = [cycle[name] for cycle in record.cycles]
    x = np.concatenate(parts)
    low, high = float(x.min()), float(x.max())
    constant = low == high
    levels = constant or is_levelled(name, x)
    noise = 0.0 if levels else estimate(record.cycles, name, record.resolution.get(name)).sigma
    noise = noise if noise > ROUNDING * (high - low) else 0.0
    step = 0.0 if levels else record.resolution.get(name) or max(quantum(part) for part in parts)
    upper = 0.0 if constant else max(_upper(part, noise) for part in parts)
    ends: tuple[float, ...] = () if name in DWELLING else (low, high)
    if name in POSITIONS:
        ends = tuple(end for end in ends if not constant and is_cut_off(x, end))
    held = _held(parts, ends, step)
    return ChannelFacts(name, CHANNELS[name].unit, low, high, float(step), float(noise), held, constant, upper)


def _held(parts: list[Array], ends: tuple[float, ...], step: float) -> float:
    """Share of samples in runs at an end; none are a cycle's rest before or after, and the levels of a command."""
    if len(np.unique(np.concatenate(parts))) <= LEVELS:
        return 0.0
    n = 0
    for part in parts:
        for end in ends:
            runs, beside = (find_runs(flags).tolist() for flags in (part == end, np.abs(part - end) < 1.5 * step))
            inner = [(first, last) for first, last in runs if first > 0 and last < len(part) and last - first >= HELD]
            n += sum(last - first for first, last in inner if not _is_peak(first, last, beside))
    share = n / sum(len(part) for part in parts)
    return share if share > ENDS else 0.0


def _is_peak(first: int, last: int, beside: list[list[int]]) -> bool:
    """Whether the run is the top of a smooth turn in steps: it is as slow on the next step as a parabola is there."""
    around = max((b - a for a, b in beside if a <= first and last <= b), default=0) - (last - first)
    return around * PARABOLA >= last - first


def _upper(x: Array, noise: float) -> float:
    """Share of the power in the upper part of the spectrum, less what white noise puts there."""
    n = len(x)
    if n < 64:
        return 0.0
    window = np.hanning(n)
    power = np.abs(np.fft.rfft((x - x.mean()) * window)) ** 2
    top = slice(int(HIGH[0] * len(power)), int(HIGH[1] * len(power)))
    white = noise**2 * float(np.sum(window**2))  # expected power of each line
    total = max(float(power[1:].sum()) - white * (len(power) - 1), 1e-300)
    return max(0.0, float(power[top].sum()) - white * len(power[top])) / total
