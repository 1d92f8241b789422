"""What was gained: on parts that were fitted, on parts that were held out, and by record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .folds import Folds
from .outcome import RecordGain
from .parts import list_parts
from .plant import Errors, Fitted, Plant
from .selection import Tried, list_folds


def training_errors(plant: Plant, plain: Tried, model: Tried) -> tuple[float, float]:
    """Errors before and after on the parts that the fits have seen."""
    blocks = [train for train, _ in list_folds(plant)]
    before, after = (
        _pooled([plant.errors(f.point, own).error for f, own in zip(t.fits, blocks, strict=True)])
        for t in (plain, model)
    )
    return before, after


def over_folds(plant: Plant, plain: Tried, model: Tried) -> Folds:
    """Errors before and after of every part of the records, each by the fits that had not seen it."""
    parts = list_parts(plant)
    rows = [(name, *_of_part(plant, plain, model, blocks)) for name, _, blocks in parts]
    names, before, after, floor, weight = zip(*rows, strict=True)
    of_group: dict[str, float] = {}
    for (_, group, _), w in zip(parts, weight, strict=True):
        of_group[group] = of_group.get(group, 0.0) + w
    shares = tuple(w / of_group[group] for (_, group, _), w in zip(parts, weight, strict=True))  # records count alike
    return Folds(names, before, after, floor, shares)


def residual_over_folds(plant: Plant, plain: Tried, model: Tried) -> Folds:
    """Mean squares of the whitened residual of every part, each by the fits that had not seen it; noise makes one."""
    parts = list_parts(plant)
    before, after = ([_rms(t, blocks) ** 2 for _, _, blocks in parts] for t in (plain, model))
    n = tuple(float(sum(model.held_out[j].size for j in blocks)) for _, _, blocks in parts)
    return Folds(tuple(name for name, _, _ in parts), tuple(before), tuple(after), (1.0,) * len(parts), n)


def _rms(model: Tried, blocks: set[int]) -> float:
    """`Tried.rms` of some blocks."""
    return replace(model, held_out=tuple(model.held_out[j] for j in sorted(blocks))).rms


def by_record(plant: Plant, plain: Tried, model: Tried) -> list[RecordGain]:
    """Errors before and after of the held-out parts of each record."""
    out = []
    for group in dict.fromkeys(b.group for b in plant.blocks):
        mine = {j for j, b in enumerate(plant.blocks) if b.group == group}
        before, after = (_errors(plant, t, mine) for t in (plain, model))
        errors = (
            _pooled(x) for x in ([e.error for e in before], [e.error for e in after], [e.noise_floor for e in after])
        )
        out.append(RecordGain(group, *errors, *(_rms(t, mine) for t in (plain, model))))
    return out


def _errors(plant: Plant, model: Tried, blocks: set[int]) -> list[Errors]:
    """Of some blocks, by the fit of each fold that left some of them out."""
    found = []
    for (_, left_out), fitted in zip(list_folds(plant), model.fits, strict=True):
        if own := [j for j in left_out if j in blocks]:
            found.append(plant.errors(fitted.point, own, Fitted(fitted.free, fitted.by_noise)))
    return found


def _of_part(plant: Plant, plain: Tried, model: Tried, blocks: set[int]) -> tuple[float, float, float, float]:
    """Mean squares before, after and of the floor, and the weight."""
    before, after = (_errors(plant, t, blocks) for t in (plain, model))
    w = np.array([e.weight for e in after])
    squares = (
        float(np.square(x) @ w / w.sum())
        for x in ([e.error for e in before], [e.error for e in after], [e.noise_floor for e in after])
    )
    b, a, f = squares
    return b, a, f, float(w.sum())


def _pooled(errors: list[float]) -> float:
    return float(np.sqrt(np.mean([e**2 for e in errors])))
