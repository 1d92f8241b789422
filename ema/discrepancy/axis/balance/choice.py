"""Which laws the records need, and what cannot be told from each: forward and backward on held-out blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ema.core.records import Array
from ema.models.axis_config import LinearAxis

from .agreement import INEXACT, Agreement, against, agreements
from .apart import apart
from .attenuation import Corrected, attenuation
from .course import Course, courses
from .law import Acting, Law
from .laws import LINEAR, LINES, ROTARY, laws, of_base
from .links import LINKS, links
from .own_zeros import with_zeros
from .regression import BY_RECORD, Plain, Regression, fitted
from .rows import LONGEST, STILL, Rows, half_widths, rows

if TYPE_CHECKING:
    from ema.discrepancy.axis.measured import Measured

MOST_LAWS = 8
CLEAR = 3.0  # deviations over blocks by which a law must foretell held-out blocks better
MATTERS = 0.1  # share of what is left that a law must take
LEAST = 3e-4  # share of the drive's torque in power that a law must take
SELDOM = 0.05  # share of draws that another law must win to be one that the records cannot tell
CONSTANT = 0.02  # share by which a voltage must change to drive by more than its value
APART = 0.05  # of a law's size that must stand out of what inertia, dry friction and drag do
N_WIDTHS = 3  # rounds
MOVED = 2.0  # deviations of the difference between two widths, from which an inertia is another
N_WIDER = 3  # times that test functions are made twice as wide
LONG = 0.5  # share of a row that must show which way friction acts, however small that is
BY_NAME = BY_RECORD.replace(" ", "_")
N_DRAWS = 400  # of blocks, to see how often a law wins


@dataclass(frozen=True)
class Term:
    """A law that the records need.

    `power` is the mean square [N² m² or N²] that held-out blocks lose by it, `alike` what does as well, by how often
    it wins over draws of blocks; `wins` how often this law does. `common` is the share that another law of the
    library has on average in common with this one, on these motions: so much of an unknown rest may be taken for it.
    """

    law: Law
    power: float
    wins: float
    alike: dict[str, float]
    common: float


@dataclass(frozen=True)
class Balance:
    """What a regression of the balance explains.

    Attributes
    ----------
    corrected : Corrected
        Coefficients without what noise in the regressors takes from them, with their covariance.
    drive : float
        Mean square of the drive's torque about its mean. [N² m² or N²]
    left_plain, left_base, left : float
        Mean square left on held-out blocks by the plant file's numbers, with inertia, friction and drag fitted, and
        with the laws found.
    noise : float
        What the sensors' noise leaves.
    agreements : tuple of Agreement
        Where several records are given: each coefficient record by record.
    given : tuple of Law
        What the plant file declares beside inertia, friction and drag: a neighbouring axis.
    """

    model: Regression
    corrected: Corrected
    plain: Plain
    terms: tuple[Term, ...]
    drive: float
    left_plain: float
    left_base: float
    left: float
    noise: float
    agreements: tuple[Agreement, ...] = ()
    given: tuple[Law, ...] = ()

    def confidence(self, term: Term) -> float:
        """How often the law wins, times its mark over that and what of the rest it may have been taken for.

        What records contradict each other in counts against it.
        """
        rest = term.common * max(self.left - self.noise, 0.0)
        sure = term.wins * term.power / (term.power + rest) if term.power > 0.0 else 0.0
        return sure * against(term.law, self.agreements)

    def explained(self, left: float) -> float:
        """Share of the drive's torque, as a coefficient of determination."""
        return 1.0 - left / self.drive


def balance(plant: Measured) -> Balance | None:
    """The balance of all records; None where no stretch of motion is long enough."""
    p = plant.plant
    plain = Plain(p.inertia, p.F_d, p.C, 1.0 if p.is_force else float(p.k_t or 1.0))
    recorded = with_zeros(plant, courses(plant), plain)
    found = rows(plant, recorded)
    if found is None:
        return None
    linear = isinstance(p, LinearAxis)
    if _is_given(plant, recorded, found):
        return None
    size = float(np.sqrt(np.mean(found.drive**2)))
    answer, widths, unsure = None, None, 0.0
    for _ in range(N_WIDTHS):  # how wide test functions must be depends on what stands beside the acceleration
        first = answer.model if answer is not None else fitted(found, plain, [])
        wider = half_widths(recorded, _heaviest(first, p.inertia), size)
        if widths is not None and all(wider[name] <= widths[name] for name in wider):
            break
        widths = wider if widths is None else {name: max(wider[name], widths[name]) for name in wider}
        unsure = unsure_share(first, plain, size)
        found = rows(plant, recorded, widths, unsure) or found
        answer = chosen(found, plain, shown_by(found, list(every_law(found, linear=linear))), given(found))
    assert answer is not None
    assert widths is not None
    for _ in range(N_WIDER):
        wide = {name: 2.0 * half for name, half in widths.items()}
        slower = rows(plant, recorded, wide, unsure)
        if slower is None or _has_no_room(recorded, wide) or not _is_moved(answer.model, slower, plain):
            break
        found, widths = slower, wide
        answer = chosen(found, plain, shown_by(found, list(every_law(found, linear=linear))), given(found))
    return replace(
        answer,
        corrected=attenuation(plant, recorded, widths, plain, answer.model, unsure),
        agreements=tuple(agreements(found, plain, answer.model)),
    )


def _has_no_room(recorded: Sequence[Course], widths: dict[str, float]) -> bool:
    return any(not c.static and float(np.ptp(c.t)) < LONGEST * widths[c.record] for c in recorded)


def _is_moved(model: Regression, slower: Rows, plain: Plain) -> bool:
    """Whether slower test functions give another inertia: then the quick part of the motion is none that the laws make.

    A frame that swings, a gear that gives or noise beyond what the sensors are known to have takes from every
    coefficient, the more the narrower test functions are (Hausman, "Specification tests in econometrics",
    Econometrica 46, 1978).
    """
    if "inertia" not in model.base:
        return False
    other = fitted(slower, plain, model.laws)
    if other.base != model.base:
        return False
    k = model.base.index("inertia")
    here, there = float(model.coefficients[k]), float(other.coefficients[k])
    spread = float(np.sqrt(abs(other.covariance()[k, k] - model.covariance()[k, k])))
    return abs(there - here) > max(MOVED * spread, INEXACT * max(abs(here), abs(there)))


def every_law(found: Rows, *, linear: bool) -> list[Law]:
    """Laws that all records share, and each with own coefficients by record."""
    shared = list(laws(found.motion, linear=linear))
    return [*shared, *apart(found.motion, shared, of_base(LINEAR if linear else ROTARY))]


def unsure_share(model: Regression, plain: Plain, drive: float) -> float:
    """Share of a row in which friction may act either way, or less than in sliding, and be no more than noise."""
    if "dry_friction" not in model.base:
        return 0.0
    F_d = plain.F_d + float(model.coefficients[model.base.index("dry_friction")])
    return min(STILL * drive / max(abs(F_d), 1e-300), LONG)


def _is_given(plant: Measured, recorded: Sequence[Course], found: Rows) -> bool:
    """Whether the drive's torque is no measurement: by a constant voltage it is a function of speed, whatever acts."""
    if plant.plant.drive != "voltage" or any(c.current is not None for c in recorded):
        return False
    u = found.integrate @ np.concatenate([c.drive for c in recorded])
    return float(np.ptp(np.abs(u))) < CONSTANT * float(np.abs(u).max(initial=0.0))


def shown_by(found: Rows, every: Sequence[Law]) -> list[Law]:
    """Laws that the motions can show beside inertia, dry friction and drag."""
    m = found.motion
    base = np.column_stack([found.alpha, found.integrate @ m.direction, found.integrate @ m.w])
    size = np.linalg.norm(base, axis=0)
    q, _ = np.linalg.qr(base[:, size > 0.0] / size[size > 0.0])
    out = []
    for law in every:
        if law.needs_acting:
            out.append(law)
            continue
        A = np.column_stack(found.of(law, Acting(m.drive, m.drive, m.drive)))
        beside = np.linalg.norm(A - q @ (q.T @ A), axis=0)
        if bool((beside > APART * np.linalg.norm(A, axis=0)).any()):
            out.append(law)
    return out


def _heaviest(model: Regression, inertia: float) -> float:
    """The largest coefficient of an acceleration, of the fit or the plant file. [kg m² or kg]"""
    found = [inertia, *(model.coefficients[:1].tolist() if "inertia" in model.base else [])]
    for law in model.laws:
        if law.name == "linked_axis":
            found += model.coefficients[model.part(law)][:2].tolist()
    return float(np.max(np.abs(found)))


def given(found: Rows) -> list[Law]:
    """Laws that the plant file declares: of a neighbouring axis."""
    return [links(found.motion)] if found.motion.neighbour else []


def chosen(found: Rows, plain: Plain, every: Sequence[Law], given: Sequence[Law] = ()) -> Balance:
    """Forward and backward selection beside the laws that are `given`."""
    n = int(found.whole.sum())
    drive = float(np.var(found.drive[found.whole]))
    base = fitted(found, plain, given)
    model, declared = base, {law.key for law in given}
    while len(model.laws) < MOST_LAWS:
        trials = _trials(found, plain, model, every)
        best = _simplest(trials, drive * n)
        if best is None or not _is_needed(best, model, drive * n):
            break
        model = _revised(found, plain, best, every, drive * n)
    while (fewer := _exchanged(found, plain, model, every, drive * n)) is not None:
        model = fewer
    terms = tuple(_term(found, plain, model, law, every) for law in model.laws if law.key not in declared)
    return Balance(
        model, Corrected(model.coefficients, model.covariance()), plain, terms, drive,
        float(np.mean((found.y - plain.inertia * found.alpha)[found.whole] ** 2)),
        base.loss / n, model.loss / n, float(np.mean(found.sigma[found.whole] ** 2)),
        given=tuple(given),
    )  # fmt: skip


def _simplest(trials: Sequence[Regression], whole: float) -> Regression | None:
    """The trial that leaves least; of two of which one holds the other, the larger only where it needs to be."""
    best = min(trials, key=lambda r: r.loss, default=None)
    if best is None:
        return None
    held = [r for r in trials if r.laws[-1].family in _held(best.laws[-1].family)]
    return next((r for r in held if not _is_needed(best, r, whole)), best)


def _trials(found: Rows, plain: Plain, model: Regression, every: Sequence[Law]) -> list[Regression]:
    """The model with one law more: of each family that is not in it the member that fits best."""
    have = {law.key for law in model.laws}
    single = {law.family for law in model.laws if law.family not in LINES}
    single |= {other for law in model.laws for other in _held(law.family) if other not in LINES}
    have |= {law.key.removesuffix(BY_RECORD) for law in model.laws}
    members: dict[str, list[Law]] = {}
    for law in every:
        if law.key not in have and law.family not in single:
            members.setdefault(law.family, []).append(law)
    return [fitted(found, plain, _with(model, _best(found, model, own))) for own in members.values()]


def _with(model: Regression, law: Law) -> list[Law]:
    """The laws of a model and one more; that one by record takes the place of the same for all."""
    return [*(own for own in model.laws if law.repeats is None or own.key != law.repeats.key), law]


HOLDS = {"spring": ("constant",), LINKS: ("pendulum",)}  # a spring has its own zero


def _held(family: str) -> tuple[str, ...]:
    """Families that one of another family holds: with own coefficients by record, also those of one for all."""
    shared = family.removesuffix(BY_RECORD)
    held = HOLDS.get(shared, ())
    return held if family == shared else (shared, *held, *(f"{other}{BY_RECORD}" for other in held))


def _best(found: Rows, model: Regression, members: Sequence[Law]) -> Law:
    """The member of a family whose columns take most of what is left."""
    if len(members) == 1:
        return members[0]
    q, _ = np.linalg.qr(model.design)
    left = model.left - q @ (q.T @ model.left)
    columns = [found.of(law, model.acting) for law in members]
    A = np.array(columns)  # (n_members, n_columns, n_rows)
    A -= (A @ q) @ q.T
    gram, b = A @ A.transpose(0, 2, 1), A @ left
    gains = np.einsum("mc,mcd,md->m", b, np.linalg.pinv(gram, rcond=1e-6, hermitian=True), b)
    return members[int(np.argmax(gains))]


def _is_needed(new: Regression, old: Regression, whole: float) -> bool:
    """Clearly better over blocks, by a share of what is left and of the drive's torque that matters."""
    d = old.losses - new.losses
    gain = float(d.sum())
    votes = d / (old.losses + float(np.mean(old.losses)))  # no block may outvote all others
    clear = float(votes.sum()) > CLEAR * float(np.sqrt(len(d)) * np.std(votes))
    return clear and gain > MATTERS * old.loss and gain > LEAST * whole


def _revised(found: Rows, plain: Plain, model: Regression, every: Sequence[Law], whole: float) -> Regression:
    """Without laws that later ones made superfluous, or with another in their place that does clearly better."""
    for law in model.laws[:-1]:
        if law.family in (*LINES, LINKS):
            continue  # lines stand beside each other, and a neighbour is declared
        without = fitted(found, plain, [own for own in model.laws if own.key != law.key])
        if not _is_needed(model, without, whole):
            model = without
            continue
        other = _simplest(_trials(found, plain, without, every), whole)
        if other is not None and other.laws[-1].key != law.key and _is_needed(other, model, whole):
            model = other
    return model


def _exchanged(found: Rows, plain: Plain, model: Regression, every: Sequence[Law], whole: float) -> Regression | None:
    """A model of fewer laws that leaves no more: one law may do what several stood in for."""
    single = [law for law in model.laws if law.family not in (*LINES, LINKS)]
    for trial in _trials(found, plain, model, every) if len(single) > 1 else ():
        reduced = trial
        for law in single:
            without = fitted(found, plain, [own for own in reduced.laws if own.key != law.key])
            if not _is_needed(reduced, without, whole):
                reduced = without
        if len(reduced.laws) < len(model.laws) and not _is_needed(model, reduced, whole):
            return reduced
        if len(reduced.laws) == len(model.laws) and _is_needed(reduced, model, whole):
            return reduced
    return None


def _term(found: Rows, plain: Plain, model: Regression, law: Law, every: Sequence[Law]) -> Term:
    """How sure a law is beside all that could stand in its place."""
    without = fitted(found, plain, [own for own in model.laws if own.key != law.key])
    others = [r for r in _trials(found, plain, without, every) if r.laws[-1].key != law.key]
    siblings: dict[str, list[Law]] = {}
    for other in every:
        if other.family == law.family and other.name != law.name:
            siblings.setdefault(other.name, []).append(other)
    same = [fitted(found, plain, _with(without, _best(found, without, own))) for own in siblings.values()]
    rivals: dict[str, Array] = {}
    for r in [*others, *same]:
        own = r.laws[-1].name.removesuffix(BY_NAME)
        if law.family in _held(r.laws[-1].family) and not _is_needed(r, model, 0.0):
            continue  # it can do what this law does and more, and need not
        if own != law.name.removesuffix(BY_NAME) and (own not in rivals or r.loss < float(rivals[own].sum())):
            rivals[own] = r.losses
    names, losses = [law.name, *rivals], np.stack([model.losses, *rivals.values()])
    rng = np.random.default_rng(0)
    drawn = rng.multinomial(losses.shape[1], np.full(losses.shape[1], 1.0 / losses.shape[1]), N_DRAWS)
    winners = np.argmin(losses @ drawn.T, axis=0)
    share = {name: float(np.mean(winners == k)) for k, name in enumerate(names)}
    alike = {name: share[name] for name in rivals if share[name] > SELDOM}
    common = float(np.mean([model.shared(law, r) for r in others])) if others else 0.0
    return Term(law, (without.loss - model.loss) / max(int(found.whole.sum()), 1), share[law.name], alike, common)
