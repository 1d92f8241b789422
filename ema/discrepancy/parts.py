"""Parts of the records, by which errors and gains scatter."""

from __future__ import annotations

import numpy as np

from .plant import Plant

N_PARTS = 20  # at most, of all records together; neighbouring stretches of one record make one


def list_parts(plant: Plant) -> list[tuple[str, str, set[int]]]:
    """Name, record and blocks of each part of the records."""
    groups = list(dict.fromkeys(b.group for b in plant.blocks))
    n_each = max(1, N_PARTS // len(groups))
    parts = []
    for group in groups:
        of: dict[int, list[int]] = {}
        for j, block in enumerate(plant.blocks):
            if block.group == group:
                of.setdefault(block.stretch, []).append(j)
        stretches = list(of.values())
        for k, some in enumerate(np.array_split(np.arange(len(stretches)), min(n_each, len(stretches)))):
            blocks = {j for s in some for j in stretches[s]}
            parts.append((f"{group}, part {k + 1}{_told_when(plant, blocks)}", group, blocks))
    return parts


def _told_when(plant: Plant, blocks: set[int]) -> str:
    """From when to when blocks last, in words; empty where they have no time."""
    times = [when for j in blocks if (when := plant.blocks[j].when) is not None]
    return f" ({min(a for a, _ in times):.3g} to {max(b for _, b in times):.3g} s)" if times else ""
