"""Forward selection of effects; every score is taken on blocks the parameters were not fitted on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ema.core.records import Array

from .engine.posterior import PRIOR, log_odds
from .fitting import Fit, add_by_noise, best_fit, fit, flatten, given_back, log_likelihood, rate, scale_of, slopes
from .plant import Block, Candidate, Plant, Point

N_FOLDS = 2
FEW = 4  # parameters up to which all of them are differenced in every iteration
N_LEADING = 3  # candidates fitted with all parameters where slopes were frozen
MIN_PARTS = 40  # parts over which gains are compared in pairs
BETTER = 1.0  # [nats] by which one fit of a model is better than another, and not the end of its iteration
ODDS = 5.0  # difference in log-likelihood (150 : 1) from which one explanation is preferred
NEARLY_NOISE = 1.1  # scale of a residual below which likelihoods can be taken at their word
CHANCE = 0.006  # that parts which gain or lose alike show as much: of many small gains, 2.5 standard errors
FLIPS = 10_000  # to see that
SEED = 20
FEW_PARTS, MAX_LOSS = 4, 0.05  # parts that must gain more than `ODDS`, and losses elsewhere over all gains
MIN_SHARE = 0.02  # of the residual above noise that a further effect must explain
MIN_SHARE_OF_TERM = 0.05
SAME_SHARE = 0.03  # explanations of a residual that none explains fully are alike within this share of the gain


def split_into_folds(blocks: Sequence[Block]) -> list[list[int]]:
    """Blocks of each fold: stretches of every record alternately, so that each fold sees every motion."""
    order: dict[str, dict[int, int]] = {}
    out: list[list[int]] = [[] for _ in range(N_FOLDS)]
    for j, block in enumerate(blocks):
        seen = order.setdefault(block.group, {})
        k = seen.setdefault(block.stretch, len(seen))
        out[k % N_FOLDS].append(j)
    return out


@dataclass(frozen=True)
class Tried:
    """A model fitted on all but one fold, for each fold: `fits`; `held_out` are residuals of the left-out blocks.

    `by_noise` is what a further draw of the noise of what drives the simulation adds to these (`add_by_noise`).
    """

    accepted: tuple[Candidate, ...]  # by fold the candidates' parameters may differ; these are the first fold's
    fits: tuple[Fit, ...]
    models: tuple[tuple[Candidate, ...], ...]
    held_out: tuple[Array, ...]
    by_noise: tuple[Array, ...] = ()

    @property
    def scale(self) -> float:
        """Scale of the held-out residual, at least 1 (noise)."""
        return scale_of(self.held_out)

    @property
    def rms(self) -> float:
        """Rms of the held-out residual, single wild samples clipped: 1 is noise."""
        flat = flatten(self.held_out)
        return float(np.sqrt(np.mean(np.clip(flat, -8 * self.scale, 8 * self.scale) ** 2)))


@dataclass(frozen=True)
class Comparison:
    """How much more likely held-out data are under one model than under another.

    Attributes
    ----------
    parts : array, shape (n_parts,)
        Gain of each part of the records. [nats]
    scale : float
        Of the residuals that were compared.
    """

    parts: Array
    scale: float

    @property
    def gain(self) -> float:
        """Of all parts. [nats]"""
        return float(self.parts.sum())

    @property
    def error(self) -> float:
        """Standard error of the gain, by how parts differ. [nats]"""
        n = len(self.parts)
        return float(np.std(self.parts, ddof=1) * np.sqrt(n)) if n > 1 else np.inf

    @property
    def is_local(self) -> bool:
        """Several parts gain and hardly any loses: a stretch that is passed a few times."""
        d = self.parts
        return bool((d > ODDS).sum() >= FEW_PARTS and -d[d < 0.0].sum() < MAX_LOSS * d[d > 0.0].sum())

    @cached_property
    def by_chance(self) -> float:
        """How often parts gain as much that are as likely to lose what they gain (Fisher's randomisation test).

        What shows in one of several motions has most of its gain in few parts: a standard error, which they make, would
        never be a small share of it.
        """
        signs = np.random.default_rng(SEED).choice(np.array([-1.0, 1.0], np.float32), (FLIPS, len(self.parts)))
        return float(np.mean(signs @ self.parts >= self.gain))

    @property
    def is_significant(self) -> bool:
        """Better by more than chance. Where something is left unexplained, likelihoods alone promise too much."""
        return self.gain > ODDS and (self.is_local or self.by_chance < CHANCE)

    @property
    def is_clear(self) -> bool:
        """The other one is ruled out."""
        return self.gain > max(ODDS, 2.0 * self.error)


def compare(one: Tried, other: Tried, scale: float | None = None) -> Comparison:
    """Gain in held-out log-likelihood of `one` over `other`."""
    scale = scale if scale is not None else min(one.scale, other.scale)
    return Comparison(log_scores(one, scale) - log_scores(other, scale), scale)


def log_scores(tried: Tried, scale: float) -> Array:
    """Held-out log-likelihood of each part of the records, shape (n_parts,), up to a constant. [nats]

    What a model takes from a residual by taking the drive's noise is not counted for it.
    """
    n = max(1, -(-MIN_PARTS // max(len(tried.held_out), 1)))
    blocks = log_likelihood(tried.held_out, scale)
    if tried.by_noise:
        blocks = [own + back for own, back in zip(blocks, given_back(tried.by_noise, scale), strict=True)]
    return np.array([float(part.sum()) for block in blocks for part in np.array_split(block, n)])


def add_prior(score: float, tried: Tried) -> float:
    """The evidence for a set of effects: what held-out parts say, and how likely so many are. [nats]"""
    return score + log_odds(PRIOR) * len(tried.accepted)


def find_likeliest(model: Tried, others: Sequence[Tried]) -> Tried:
    """The set of effects with the largest evidence: `model` where no other's is larger by `BETTER`."""
    scale = min(t.scale for t in (model, *others))
    evidence = [add_prior(float(log_scores(t, scale).sum()), t) for t in (model, *others)]
    best = int(np.argmax(evidence))
    return others[best - 1] if evidence[best] > evidence[0] + BETTER else model


def list_folds(plant: Plant) -> list[tuple[list[int], list[int]]]:
    """For each fold the blocks to fit on and those left out."""
    everything = range(len(plant.blocks))
    return [([j for j in everything if j not in set(out)], out) for out in split_into_folds(plant.blocks)]


def fit_model(
    plant: Plant,
    models: Sequence[Sequence[Candidate]],
    starts: Sequence[Sequence[Point]],
    frozen: Sequence[Array | None] = (None,) * N_FOLDS,
) -> Tried:
    """Fit one model (its candidates by fold) on all but one fold each; `starts` and `frozen` slopes by fold."""
    fits: list[Fit] = []
    parts = list_folds(plant)
    for (blocks, _), model, start, known in zip(parts, models, starts, frozen, strict=True):
        free = [*plant.base, *(f for c in model for f in c.free)]
        fits.append(best_fit(plant, free, start, blocks, frozen=known))
    fits = [_help_by_other_folds(plant, own, fits) for own in fits]
    held: dict[int, Array] = {}
    by_noise: dict[int, Array] = {}
    for (_, left_out), fitted in zip(parts, fits, strict=True):
        residuals = plant.residuals([fitted.point], left_out)[0]
        held.update(zip(left_out, residuals, strict=True))
        by_noise.update(zip(left_out, add_by_noise(plant, fitted.point, left_out, residuals), strict=False))
    ordered, noise = (tuple(of[j] for j in sorted(of)) for of in (held, by_noise))
    return Tried(tuple(models[0]), tuple(fits), tuple(tuple(m) for m in models), ordered, noise)


def try_at(plant: Plant, point: Point, residuals: Sequence[Array] | None = None) -> Tried:
    """A model at a point by all blocks, with its `residuals` there if these are known."""
    blocks = range(len(plant.blocks))
    residuals = plant.residuals([point], blocks)[0] if residuals is None else residuals
    return Tried((), (), (), tuple(residuals), tuple(add_by_noise(plant, point, blocks, residuals)))


def _help_by_other_folds(plant: Plant, own: Fit, fits: Sequence[Fit]) -> Fit:
    """The fit, begun again where another fold ended if that is better here: dry friction has side minima."""
    names = [f.name for f in own.free]
    for other in fits:
        if other is own or [f.name for f in other.free] != names or not names:
            continue
        residuals = plant.residuals([other.point], own.blocks)[0]
        more = add_by_noise(plant, other.point, own.blocks, residuals)
        here, there = rate([own.residuals, residuals], [own.more, more])
        if there > here + BETTER:
            own = fit(plant, own.free, other.point, own.blocks)
    return own


def fit_base(plant: Plant) -> Tried:
    """The plant as it is, with its base parameters fitted."""
    start = {f.name: f.start for f in plant.base}
    return fit_model(plant, [()] * N_FOLDS, [[start]] * N_FOLDS)


def fit_with_each(
    plant: Plant,
    model: Tried,
    suggest: Callable[[Point, Sequence[int]], Sequence[Candidate]],
    progress: Callable[[str], None],
) -> dict[str, Tried]:
    """The model with each suggested candidate added. A candidate must be suggested by every fold's training blocks."""
    suggested, frozen = [], []
    for (train, _), fitted in zip(list_folds(plant), model.fits, strict=True):
        suggested.append({c.key: c for c in suggest(fitted.point, train)})
        rows = flatten((*fitted.residuals, *fitted.more))
        many = len(fitted.free) > FEW
        frozen.append(slopes(plant, fitted.free, fitted.point, train, rows) if many else None)
    out = {}
    for key in suggested[0]:
        if not all(key in s for s in suggested):
            continue
        progress(key)
        models = [(*m, s[key]) for m, s in zip(model.models, suggested, strict=True)]
        starts = [
            [{**fitted.point, **start} for start in s[key].starts]
            for fitted, s in zip(model.fits, suggested, strict=True)
        ]
        out[key] = fit_model(plant, models, starts, frozen)
    if any(known is not None for known in frozen):
        for key in _find_leading(out, model):
            progress(f"{key}, all parameters")
            out[key] = refit(plant, out[key])
    return out


def superpose(plant: Plant, before: Tried, trials: Sequence[Tried]) -> Tried:
    """The model `before` with what each of several trials added to it."""
    models, starts = [], []
    for k, own in enumerate(before.fits):
        added = [(trial.models[k][-1], trial.fits[k].point) for trial in trials]
        names = [{*candidate.starts[0], *(f.name for f in candidate.free)} for candidate, _ in added]
        of = {name: point[name] for (_, point), these in zip(added, names, strict=True) for name in these}
        models.append([*before.models[k], *(candidate for candidate, _ in added)])
        starts.append([{**own.point, **of}])
    return fit_model(plant, models, starts)


def _find_leading(trials: dict[str, Tried], model: Tried) -> list[str]:
    """The few best candidates, between which the decision lies."""
    if not trials:
        return []
    scale = min(t.scale for t in trials.values())
    gains = {key: compare(trial, model, scale).gain for key, trial in trials.items()}
    ranked = sorted(gains, key=lambda key: -gains[key])[:N_LEADING]
    return [key for key in ranked if gains[key] > 0.5 * gains[ranked[0]]]


def refit(plant: Plant, tried: Tried) -> Tried:
    """The same model with all its parameters fitted together."""
    return fit_model(plant, tried.models, [[fitted.point] for fitted in tried.fits])


def find_best(trials: dict[str, Tried], model: Tried) -> str:
    """Key of the candidate under which held-out data are most likely."""
    scale = min(t.scale for t in trials.values())
    return max(trials, key=lambda key: compare(trials[key], model, scale).gain)


def is_nameless(key: str, trial: Tried) -> bool:
    """Whether what was tried under `key` (not always the last of the model) is a term of the structure."""
    return any(c.key == key and c.is_structure for c in trial.accepted)


def choose(trials: dict[str, Tried], model: Tried) -> str | None:
    """Key of what to add: the best of the library, unless a nameless term foretells held-out data clearly better."""
    nameless = {key: t for key, t in trials.items() if is_nameless(key, t)}
    named = {key: t for key, t in trials.items() if key not in nameless}
    if not named or not nameless:
        return find_best(trials, model) if trials else None
    one, other = find_best(named, model), find_best(nameless, model)
    lead = compare(trials[other], trials[one])
    if lead.is_clear and lead.gain > SAME_SHARE * compare(trials[other], model).gain:
        return other
    if is_worth_it(trials[one], model) or not is_worth_it(trials[other], model):
        return one
    return other


def above_noise(tried: Tried) -> float:
    """Mean square of the held-out residual above that of noise."""
    return max(tried.rms**2 - 1.0, 0.0)


def is_worth_it(new: Tried, old: Tried) -> bool:
    """A further effect must be significant and explain a share of what is not noise; a nameless term a larger one."""
    return compare(new, old).is_significant and _is_a_share(new, old)


def may_be_worth_it(new: Tried, old: Tried) -> bool:
    """What an effect gains is a share of what is not noise, if perhaps by chance; a nameless term must be worth it."""
    if new.accepted[-1].is_structure:
        return is_worth_it(new, old)
    return compare(new, old).gain > ODDS and _is_a_share(new, old)


def _is_a_share(new: Tried, old: Tried) -> bool:
    share = (above_noise(old) - above_noise(new)) / max(above_noise(old), 1e-12)
    nameless = len(new.accepted) > len(old.accepted) and new.accepted[-1].is_structure
    return share > (MIN_SHARE_OF_TERM if nameless else MIN_SHARE)
