"""The best models with one more effect: of those that promise most, fitted, with what resembles them."""

from __future__ import annotations

from collections.abc import Sequence

from ema.core.names import FAULTS

from .fit import fit
from .resembling import looking_like
from .ridge import walked
from .screening import AT_LEAST, Screened, simulated, start_with
from .search import FAR, Model, Search

N_REFINED = 4
WORTH_A_FIT = 0.1  # share of the squared residual beyond noise that a candidate must promise, to first order
NO_WORSE = 1.5  # times the squared residual of the best start, from which a start with fewer faults is not preferred
REACHED = 1.5  # misfit of a model that may be the right one, but for noise that is not its own
NEARLY_ALL = 0.01  # share of what there was to explain, up to which a rival may still leave it for want of iterations
NEAR_NOISE = 0.05  # excess below which a fit need not go on


def extend(search: Search, model: Model, screened: Sequence[Screened], known: Sequence[Model] = ()) -> list[Model]:
    """The best models with one more effect of those screened, best first.

    With `known`, those that first order has led to, candidates that are not among them are simulated instead.
    """
    tried = {m.names[-1] for m in known}
    screened = [s for s in screened if s.candidate.effect not in tried]
    if known or model.excess > FAR:
        screened = simulated(search, model, screened)
    refined = _for_several_faults(search, model, screened)
    refined |= _likeliest(search, model, screened, set(refined))
    if not refined:
        return []
    best = min(refined.values(), key=lambda m: m.heldout)
    for s in looking_like(search, model, best, screened, set(refined)):
        m = _refined(search, model, s)
        effect = s.candidate.effect
        refined[effect] = min(m, refined.get(effect, m), key=lambda x: x.heldout)
    # A rival is out only if it leaves more when fitted as well as the best.
    for name, m in _close(refined, model):
        again = search.model(m.effects, m.fit.free, m.fit.point, None, 4)
        refined[name] = min(m, again, key=lambda x: x.heldout)
    return sorted(refined.values(), key=lambda m: m.heldout)


def _for_several_faults(search: Search, model: Model, screened: Sequence[Screened]) -> dict[str, Model]:
    """One cause for several faults, tried whatever it promises, since the faults hide that.

    Unless another one, simulated far from the data, takes nearly all by itself.
    """
    if model.excess > FAR and screened[0].promised < NEARLY_ALL * _cost(model):
        return {}
    found: dict[str, Model] = {}
    for s in screened:
        if s.candidate.effect not in found and model.shows_faults_of(s.candidate):
            found[s.candidate.effect] = _refined(search, model, s)
    return found


def _likeliest(search: Search, model: Model, screened: Sequence[Screened], known: set[str]) -> dict[str, Model]:
    """Those that promise most, one at least if none is known."""
    cost = _cost(model)
    worth = max(WORTH_A_FIT * (cost - cost / model.fit.misfit), AT_LEAST * cost)
    found: dict[str, Model] = {}
    for s in screened:
        if (known or found) and cost - s.promised < worth:
            break
        if len(found) >= N_REFINED or (found and _clear(search, found, s.promised)):
            break
        if s.candidate.effect not in {*known, *found}:
            found[s.candidate.effect] = _refined(search, model, s)
    return found


def _cost(model: Model) -> float:
    return sum(float(r @ r) for r in model.fit.residuals.values())


def _refined(search: Search, model: Model, s: Screened) -> Model:
    frees = (*model.fit.free, *s.candidate.frees)
    start, cost = search.better([s.start, start_with(search, model, s.candidate, dict.fromkeys(FAULTS, 0.0))], model)
    if model.shows_faults_of(s.candidate):
        # One effect for several faults, or for what they have in common, is the simpler cause; noise in the
        # columns would leave the faults there.
        faults = s.candidate.faults
        k = model.fit.point
        common = min(k[name] for name in faults)
        less = (dict.fromkeys(faults, 0.0), {name: k[name] - common for name in faults})
        nearer, _ = search.better([start_with(search, model, s.candidate, rest) for rest in less], model)
        # From there the effect alone goes as far as it can.
        alone = fit(search.plant, search.noise, s.candidate.frees, nearer, search.train, n_iterations=3)
        simpler, simpler_cost = search.better([alone.point], model)
        if simpler_cost < NO_WORSE * cost:
            start = simpler
    made = search.model((*model.effects, s.candidate), frees, start, model.fit.columns, 3)
    return walked(search, model, made, s.candidate) if model.shows_faults_of(s.candidate) else made


def _close(refined: dict[str, Model], model: Model) -> list[tuple[str, Model]]:
    """The models near the best, by what there was to explain too; none if the best stands alone without a rest."""
    ranked = sorted(refined.items(), key=lambda item: item[1].heldout)
    best = ranked[0][1]
    near = [(name, m) for name, m in ranked[:3] if m.excess < max(2.0 * best.excess + 0.2, NEARLY_ALL * model.excess)]
    return near if len(near) > 1 or best.excess > NEAR_NOISE else []


def _clear(search: Search, refined: dict[str, Model], promised: float) -> bool:
    """Whether one leaves nearly nothing, and what is left to try promises far less."""
    n = sum(len(search.plant.data.y[c]) for c in search.train)
    reached = min(m.fit.misfit for m in refined.values())
    return reached < REACHED and promised / n > 3.0 * reached + 0.5
