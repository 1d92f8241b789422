"""A drive that changes faster than it is sampled is refused: what it did between the samples nobody knows."""

from __future__ import annotations

import numpy as np

from ema.core.errors import RecordError
from ema.core.records import Array, Cycle, Record
from ema.models.axis_config import Axis

from .channels import DRIVE_CHANNEL

WHITE = 0.2  # share of the drive's power above a quarter of the rate; of white noise it is a half
FORETOLD = 0.8  # share of the speed's changes that a recorded drive must foretell where it is as white as that
FEW = 5  # samples that differ from all others are no record of a drive
BETTER = "steps or sines well below half the rate would do, or a faster record"
SEGMENT = 64  # samples
MUCH = 0.3  # share of the drive's power that lies in segments as white as that


def refuse_undersampled(plant: Axis, record: Record) -> None:
    """RecordError where a commanded drive is sampled too slowly for what it does."""
    drive = DRIVE_CHANNEL[plant.drive]
    if plant.drive not in ("voltage", "speed-loop") or drive not in record.channels or "i_q" in record.channels:
        return  # what was measured has noise of its own, and a motor's inductance smooths it
    white, power, foretold = 0.0, 0.0, []
    for cycle in record:
        own, of_white = _white(cycle[drive])
        power, white = power + own, white + of_white
        foretold.append(_foretold(plant, cycle, drive))
    worst = min(foretold, default=1.0)
    period = record.cycles[0].period if record.cycles else 0.0
    away = sum(int(np.sum(cycle[drive] != np.median(cycle[drive]))) for cycle in record)
    if power > 0.0 and white > MUCH * power and worst < FORETOLD:
        raise RecordError(
            f"{record.name}: {drive} changes faster than a sample in {period:.2g} s can show: {white / power:.0%} of "
            f"its power does not fall off before half the rate, it foretells {max(worst, 0.0):.0%} of the motion; not "
            f"used for identification: {BETTER}"
        )
    if away < FEW and (away > 0 or worst < FORETOLD):
        raise RecordError(
            f"{record.name}: {drive} stays the same but for {away} samples, and the axis moves: what drove it lies "
            f"between the samples; not used for identification: {BETTER}"
        )


def _white(x: Array) -> tuple[float, float]:
    """Power of the drive's changes, and that of segments that are nearly white."""
    power = white = 0.0
    for k in range(0, max(len(x) - SEGMENT // 2, 1), SEGMENT):
        part = x[k : k + SEGMENT]
        part = part - np.linspace(part[0], part[-1], len(part))  # a step or ramp is no line of the spectrum
        spectrum = np.abs(np.fft.rfft(part * np.hanning(len(part)))) ** 2
        own, fast = float(spectrum.sum()), float(spectrum[len(spectrum) // 2 :].sum())
        power += own
        white += own if fast > WHITE * own and own > 0.0 else 0.0
    return power, white


def _foretold(plant: Axis, cycle: Cycle, drive: str) -> float:
    """Share of the speed's changes that a first-order law with the recorded drive foretells."""
    speed = next((name for name in ("w_m", "v") if name in cycle), None)
    t, u = cycle["t"], cycle[drive]
    position = "theta_m" if "theta_m" in cycle else "q"
    w = cycle[speed] if speed else np.gradient(cycle[position], t)
    change = np.diff(w)
    if len(change) < 8 or float(np.var(change)) == 0.0:
        return 1.0
    h = np.diff(t) / cycle.period
    A = np.stack([h * w[:-1], h * u[:-1], h * u[1:], h], axis=1)
    left = change - A @ np.linalg.lstsq(A, change, rcond=None)[0]
    return 1.0 - float(np.var(left) / np.var(change))
