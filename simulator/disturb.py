"""What a bad bus does to frames: lost, repeated, damaged, out of order; by chance from a seed, or in a given gap."""

from __future__ import annotations

import numpy as np

from .scenario import Disturbances


def disturb(
    frames: np.ndarray, due: np.ndarray, cycle: int, disturbances: Disturbances, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Frames (n,) and due times (n,) as they leave a disturbed sender.

    Each frame is by chance damaged in one bit, sent twice, swapped with the next one of its
    identifier, or left out, in this order.
    Frames of a gap are left out.
    """
    d = disturbances
    frames = frames.copy()
    for n in np.flatnonzero(rng.random(frames.size) < d.corrupt):
        bit = rng.integers(8 * int(frames[n]["length"]))
        frames["data"][n, bit // 8] ^= 1 << bit % 8
    index = np.repeat(np.arange(frames.size), 1 + (rng.random(frames.size) < d.repeat))
    for n in np.flatnonzero(rng.random(index.size) < d.reorder):
        later = np.flatnonzero(frames["id"][index[n + 1 :]] == frames["id"][index[n]])
        if later.size:
            index[[n, n + 1 + later[0]]] = index[[n + 1 + later[0], n]]
    kept = rng.random(index.size) >= d.drop
    for gap in d.gaps:
        if gap.cycle == cycle:
            kept &= ~((due[index] >= gap.start) & (due[index] < gap.start + gap.duration))
    index = index[kept]
    return frames[index], np.sort(due[index])
