"""What can do nearly all that the last effect of a model does, beside what else is free."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .candidates import Candidate
from .features import Array
from .fit import SEED, Free, bounded, bounds, moved, stacked_jacobian
from .plant import Point
from .screening import DT_PROBE, N_PROBE, Screened, columns_of
from .search import Model, Search, stripped

COLLINEAR = 0.8  # cosine from which two effects look like each other
RESEMBLING = 0.3  # cosine by probes at the nominal point, from which they are compared where the fit is


def looking_like(
    search: Search, model: Model, best: Model, screened: Sequence[Screened], fitted: set[str]
) -> list[Screened]:
    """Those that can do, beside what else is free, nearly all that the last effect of `best` does.

    What probes do where nothing else acts may mislead: what resembles the effect there is asked once more where
    `best` is, and begins with what does the same there. So is what was fitted already, if the effect has taken the
    place of faults: from these no fit gets there.
    """
    effect = best.effects[-1]
    names = [f"{effect.effect}.{name}" for name in effect.linear]
    values = np.array([best.fit.point[name] - search.plant.neutral(name) for name in names])
    frees = [f for f in best.fit.free if f.name in names]
    done = stacked_jacobian(search.noise, frees, best.fit.columns, search.train) @ values
    replaced = effect.faults if model.shows_faults_of(effect) else []
    others, rest = stripped(best, effect)[1:]
    free, others = (tuple(f for f in of if f.name not in replaced) for of in (model.fit.free, others))
    own = stacked_jacobian(search.noise, free, model.fit.columns, search.train)
    own_there = stacked_jacobian(search.noise, others, best.fit.columns, search.train)
    found: dict[str, Screened] = {}
    for s in screened:
        c = s.candidate
        if c.effect in found or c.effect == effect.effect or (c.effect in fitted and not replaced):
            continue
        share = _doing(done, columns_of(search, c), own)
        if share > COLLINEAR and c.effect not in fitted:
            found[c.effect] = s
        elif share > RESEMBLING:
            J = _columns_at(search, best.fit.point, c)
            if _doing(done, J, own_there) > COLLINEAR:
                limits = zip(bounds(others, rest), c.limits(), strict=True)
                low, high = (np.concatenate(ends) for ends in limits)
                step, _ = bounded(np.concatenate([own_there, J], axis=1), done, low, high)
                start = {**moved(rest, others, step[: len(others)]), **c.start(step[len(others) :])}
                found[c.effect] = s._replace(start=start)
    return list(found.values())


def _columns_at(search: Search, point: Point, c: Candidate) -> Array:
    """Whitened columns (per unit) of a candidate beside all that a point has."""
    first = search.plant.first
    points = [point, *({**point, **probe} for probe in c.probes())]
    here, *there = search.plant.means(points, first, N_PROBE, SEED, (DT_PROBE,))
    names = [Free(c.probe_name(j), 0.0, 0.0, 1.0) for j in range(len(c.amounts))]
    cols = {
        (motion, f.name): (at[cycle] - here[cycle]) / amount
        for f, amount, at in zip(names, c.amounts, there, strict=True)
        for motion, cycle in enumerate(first)
    }
    return stacked_jacobian(search.noise, names, cols, search.train)


def _doing(done: Array, columns: Array, own: Array) -> float:
    """What share of something columns can do beside others."""
    Q, _ = np.linalg.qr(own)
    done, columns = (x - Q @ (Q.T @ x) for x in (done, columns))
    values = np.linalg.lstsq(columns, done, rcond=None)[0]
    return float(np.linalg.norm(columns @ values)) / max(float(np.linalg.norm(done)), 1e-300)
