"""The windows of a record with more of the drive's noise: what that does in a simulation depends on the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ema.core.records import Array

from .noise import Noise
from .quiet_drive import quieten, quieten_alike
from .windows import PER_CYCLE, Bench, Part, Window

SEED = 20_261_130


def add_noise(b: Bench, share: float = 1.0) -> Bench:
    """The record's windows with a further draw of the drive's noise, as much as smoothing leaves of it.

    Smoothed as widely as the drive was, less is left than was: a sample that strayed by its noise was smoothed less.
    Smoothed anew, as widely as the drive with this noise asks for, more is left: it has some already. So windows have
    the one and the other in turn. `share` is that of the estimated noise, in power, which is there.
    """
    ways = [_noisier(b, share, anew=anew) for anew in (False, True)]
    return replace(b, windows=tuple(ways[k % 2][k] for k in range(len(b.windows))))


def _noisier(b: Bench, share: float, *, anew: bool) -> list[Window]:
    rng, noise = np.random.default_rng(SEED), b.noise[b.roles.drive]
    parts = {w.part.number: w.part for w in b.windows}
    noisy = {
        number: part.drive + np.sqrt(share) * (_with_noise(rng, noise, part, anew=anew) - part.drive)
        for number, part in parts.items()
    }
    courses: dict[int, Array] = {}
    for w in b.windows:
        of = courses.setdefault(id(w.course), w.course[1].copy())
        start = w.part.number % PER_CYCLE
        of[start : start + len(w.part.t)] = noisy[w.part.number]

    def noisier(w: Window) -> Window:
        part: Part = replace(w.part, drive=noisy[w.part.number])
        course = (w.course[0], courses[id(w.course)])
        return replace(w, drive=part.drive[w.first : w.first + w.n], course=course, part=part)

    return [noisier(w) for w in b.windows]


def _with_noise(rng: np.random.Generator, noise: Noise, part: Part, *, anew: bool) -> Array:
    more = noise.rms(np.gradient(part.drive, part.t)) * rng.standard_normal(len(part.t))
    if anew:
        return quieten(part.t, part.drive + more, np.empty(0, int), noise)[0]
    return part.drive + quieten_alike(more, part.left)
