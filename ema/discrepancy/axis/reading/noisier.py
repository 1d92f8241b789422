"""The windows of a record with more of the drive's noise: what that does in a simulation depends on the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ema.core.records import Array

from .noise import Noise
from .quiet_drive import quieten_alike
from .windows import PER_CYCLE, Bench, Part, Window

SEED = 20_261_130


def add_noise(b: Bench) -> Bench:
    """The record's windows with a further draw of the drive's noise, smoothed as the drive was."""
    rng, noise = np.random.default_rng(SEED), b.noise[b.roles.drive]
    parts = {w.part.number: w.part for w in b.windows}
    more = {number: _draw(rng, noise, part) for number, part in parts.items()}
    courses: dict[int, Array] = {}
    for w in b.windows:
        of = courses.setdefault(id(w.course), w.course[1].copy())
        start = w.part.number % PER_CYCLE
        of[start : start + len(w.part.t)] = w.part.drive + more[w.part.number]

    def noisier(w: Window) -> Window:
        part: Part = replace(w.part, drive=w.part.drive + more[w.part.number])
        course = (w.course[0], courses[id(w.course)])
        return replace(w, drive=part.drive[w.first : w.first + w.n], course=course, part=part)

    return replace(b, windows=tuple(noisier(w) for w in b.windows))


def _draw(rng: np.random.Generator, noise: Noise, part: Part) -> Array:
    sigma = noise.rms(np.gradient(part.drive, part.t))
    return quieten_alike(sigma * rng.standard_normal(len(part.t)), part.left)
