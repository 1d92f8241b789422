"""Sets of effects that the rounds have fitted, on one scale: what held-out parts of the records say, and a prior."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from .engine.posterior import Entry, p_cause, posterior, thin
from .fitting import Fit
from .grade import IN_SET
from .plant import Point
from .selection import NEARLY_NOISE, SAME_SHARE, Tried, add_prior, is_nameless, log_scores

TOLD = 1e-3  # probability from which a set is told


@dataclass(frozen=True)
class Weighed:
    """Sets of effects by their probability, and as they were fitted; the trials in the place of each of the model's.

    `effects` are the names in the library of what the sets hold; terms without a name are not among them.
    """

    entries: list[Entry]
    sets: dict[tuple[str, ...], Tried]
    in_place: dict[str, dict[str, Tried]]
    effects: dict[str, str]

    def instead(self, key: str) -> dict[str, float]:
        """What may stand in the place of an effect of the model, with the probability that it does; itself first."""
        own = p_cause(self.entries, key)
        p = {e.causes: e.probability for e in self.entries}
        trials = {other: p.get(_names(t), 0.0) for other, t in self.in_place[key].items() if other != key}
        whole = own + sum(trials.values())
        return {key: own, **{other: q for other, q in trials.items() if q > 0.0 and q >= IN_SET * whole}}

    def described(self, trust: Mapping[str, float]) -> list[dict[str, Any]]:
        """For findings.json (`Findings.posterior`); nothing where there is no set beside the model without effects.

        `trust`: how far each effect that the model has, or had, stands out of what is unknown; what may be in its
        place stands out as far.
        """
        if len(self.entries) < 2:
            return []
        entries = self._thinned(trust)
        top = max(e.log_evidence for e in entries)
        return [
            {
                "effects": [self.effects[key] for key in e.causes if key in self.effects],
                "faults": [],
                "probability": e.probability,
                "nats_behind": top - e.log_evidence,
                "nats_error": e.error,
            }
            for e in entries
            if e.probability >= TOLD
        ]

    def draw(self, n: int, model: Tried, final: Fit) -> list[Point]:
        """About `n` points, from every set as many as it is likely: of the `model` by its `final` fit to all records.

        So a size is as uncertain as it is unclear which other effects are there. Where another stands for something
        without a name, that is there all the same: sizes are those beside it.
        """
        points: list[Point] = []
        for entry in self.entries:
            of = self.sets.get(entry.causes)
            fits = (final,) if entry.causes == _names(model) else of.fits if of else ()
            for fit in fits:
                points += fit.draw(round(n * entry.probability / len(fits)))
        return points or final.draw(n)

    def _thinned(self, trust: Mapping[str, float]) -> list[Entry]:
        share = {other: trust.get(key, 1.0) for key, trials in self.in_place.items() for other in trials}
        keys = {key for e in self.entries for key in e.causes}
        return thin(self.entries, {**dict.fromkeys(keys, 1.0), **share, **trust})


def weigh_sets(
    plain: Tried,
    model: Tried,
    rounds: Sequence[tuple[dict[str, Tried], Tried]],
    besides: Sequence[Tried] = (),
) -> Weighed:
    """Every set of effects of the library that was fitted, beside the terms without a name that the model has.

    Where the likeliest leaves more than noise, the form of its laws is another, and so may be that of the others: each
    may be off by a share of what it explains. `rounds` hold, for each effect of `model`, the trials in its place and
    the model without it; `besides` are other sets that were fitted.
    """
    fitted = [plain, *besides]
    for trials, before in rounds:
        fitted += [*trials.values(), before]
    terms = {c.key for c in model.accepted if c.is_structure}
    sets = {_names(t): t for t in (*fitted, model) if {c.key for c in t.accepted if c.is_structure} <= terms}
    scale = min(t.scale for t in sets.values())
    parts = {names: log_scores(t, scale) for names, t in sets.items()}
    score = {names: float(of.sum()) for names, of in parts.items()}
    form = _misfits_of_form(score) if scale > NEARLY_NOISE else {}
    evidence = {names: add_prior(score[names], t) for names, t in sets.items()}
    in_place = {
        own.key: {key: t for key, t in trials.items() if not is_nameless(key, t)}
        for own, (trials, _) in zip(model.accepted, rounds, strict=True)
    }
    effects = {c.key: c.effect for t in sets.values() for c in t.accepted if not c.is_structure}
    return Weighed(posterior(evidence, parts=parts, form=form), sets, in_place, effects)


def _misfits_of_form(score: Mapping[tuple[str, ...], float]) -> dict[str, float]:
    """What each cause's law may be off by: a share of what it adds to the likeliest set that has it. [nats]

    `score` of each set, without its prior. What a cause adds is held against the likeliest set that holds less.
    """
    form = {}
    for cause in sorted({c for names in score for c in names}):
        likeliest = max((names for names in score if cause in names), key=lambda names: score[names])
        less = [x for names, x in score.items() if set(names) < set(likeliest) and cause not in names]
        form[cause] = 0.5 * SAME_SHARE * max(score[likeliest] - max(less), 0.0)
    return form


def _names(tried: Tried) -> tuple[str, ...]:
    return tuple(sorted(c.key for c in tried.accepted))
