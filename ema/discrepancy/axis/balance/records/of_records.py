"""The balance of all records: rows as wide as the acceleration needs, and the laws that they call for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ema.core.records import Array
from ema.discrepancy.axis.balance.laws.along import LINES
from ema.discrepancy.axis.balance.laws.law import Acting, Law
from ema.discrepancy.axis.balance.laws.laws import laws
from ema.discrepancy.axis.balance.laws.links import links
from ema.discrepancy.axis.balance.laws.units import LINEAR, ROTARY, of_base
from ema.discrepancy.axis.balance.regressing.agreement import INEXACT, agreements
from ema.discrepancy.axis.balance.regressing.apart import apart
from ema.discrepancy.axis.balance.regressing.choice import choose_laws
from ema.discrepancy.axis.balance.regressing.creeping import chosen, leave_creeping_out, slides
from ema.discrepancy.axis.balance.regressing.found import Balance
from ema.discrepancy.axis.balance.regressing.regression import Plain, Regression, regress
from ema.discrepancy.axis.balance.regressing.rows import Rows
from ema.models.axis_config import Axis, LinearAxis

from .attenuation import attenuation
from .course import Course, courses
from .integrated import integrate_rows
from .own_zeros import add_zeros
from .widths import LONGEST, STILL, half_widths

if TYPE_CHECKING:
    from ema.discrepancy.axis.reading.measured import Measured

CONSTANT = 0.02  # share by which a voltage must change to drive by more than its value
APART = 0.05  # of a law's size that must stand out of what inertia, dry friction and drag do
LEFT = 0.2  # of a line's size, that test functions must leave of it
N_WIDTHS = 3  # rounds
MOVED = 2.0  # deviations of the difference between two widths, from which an inertia is another
TOLD = 1.0 / 3.0  # error of an inertia, as its share, with which the motions show one
AS_SURE = 2.0  # times larger may the error of an inertia be that is told about as surely
SURER = 3.0  # times smaller is that of one that is told much better
N_WIDER = 6  # times that test functions are made twice as wide
LONG = 0.5  # share of a row that must show which way friction acts, however small that is


Halves = dict[str, float]  # half width by record [s]


def plain_of(p: Axis) -> Plain:
    """What the plant file says of what always acts."""
    return Plain(p.inertia, p.F_d, p.C, 1.0 if p.is_force else float(p.k_t or 1.0))


def balance(plant: Measured) -> Balance | None:
    """The balance of all records; None where no stretch of motion is long enough."""
    p = plant.plant
    plain = plain_of(p)
    recorded = add_zeros(plant, courses(plant))
    found = integrate_rows(plant, recorded)
    if found is None:
        return None
    linear = isinstance(p, LinearAxis)
    if _is_given(plant, recorded, found):
        return None

    def choose(rows: Rows) -> Balance:
        return choose_laws(rows, plain, shown_by(rows, list(every_law(rows, linear=linear))), given(rows))

    size = float(np.sqrt(np.mean(found.drive**2)))
    answer, widths, unsure = None, None, 0.0
    for _ in range(N_WIDTHS):  # how wide test functions must be depends on what stands beside the acceleration
        first = answer.model if answer is not None else regress(found, plain, [])
        wider = half_widths(recorded, _heaviest(first, p.inertia), size)
        if widths is not None and all(wider[name] <= widths[name] for name in wider):
            break
        widths = wider if widths is None else {name: max(wider[name], widths[name]) for name in wider}
        unsure = unsure_share(first, plain, size)
        found = integrate_rows(plant, recorded, widths, unsure) or found
        answer = choose(found)
    assert answer is not None
    assert widths is not None
    seen = widths
    for _ in range(N_WIDER):
        wide = {
            name: half if _is_wide_enough(plant, recorded, widths, seen, name, answer.model, unsure) else 2.0 * half
            for name, half in widths.items()
        }
        if wide == widths:
            break
        found, widths = integrate_rows(plant, recorded, wide, unsure, seen) or found, wide
        answer = choose(found)
    answer = leave_creeping_out(answer, choose)

    def again(noisier: list[Course]) -> Rows | None:
        rows = integrate_rows(plant, noisier, widths, unsure, seen)
        return chosen(rows, slides(rows)) if rows is not None and answer.creeps else rows

    return replace(
        answer,
        corrected=attenuation(recorded, again, plain, answer.model),
        agreements=tuple(agreements(answer.model.rows, plain, answer.model)),
    )


def _has_no_room(recorded: Sequence[Course], widths: dict[str, float]) -> bool:
    return any(not c.static and float(np.ptp(c.t)) < LONGEST * widths[c.record] for c in recorded)


def _is_wide_enough(
    plant: Measured,
    recorded: list[Course],
    halves: Halves,
    seen: Halves,
    name: str,
    model: Regression,
    unsure: float,
) -> bool:
    """Whether in one record slower test functions give no other inertia that is as sure, and none much surer.

    Where they do, the quick part of the motion is none that the laws make. A frame that swings, a gear that gives or
    noise beyond what the sensors are known to have takes from every coefficient, the more the narrower test functions
    are (Hausman, "Specification tests in econometrics", Econometrica 46, 1978). Above a resonance all agree on the
    inertia of one side of it, so they are held against every width that the record has room for.
    """
    here = _inertia(model)
    own = {**halves, name: 2.0 * halves[name]}  # what swings besides in one record says nothing of another
    while here is not None and not _has_no_room(recorded, own):
        slower = integrate_rows(plant, recorded, own, unsure, seen)
        there = _inertia(regress(slower, plain_of(plant.plant), model.laws)) if slower is not None else None
        if there is not None and _is_better(here, there):
            return False
        own[name] *= 2.0
    return True


def _inertia(model: Regression) -> tuple[float, float] | None:
    """The inertia and its variance, where the motions show one."""
    if "inertia" not in model.base:
        return None
    k = model.base.index("inertia")
    return float(model.coefficients[k]), float(model.covariance()[k, k])


def _is_better(here: tuple[float, float], there: tuple[float, float]) -> bool:
    """Whether slower test functions, `there`, give another inertia that is about as sure, or tell it much better."""
    (a, V), (b, W) = here, there
    error, slower = float(np.sqrt(V)) / max(abs(a), 1e-300), float(np.sqrt(W)) / max(abs(b), 1e-300)
    moved = abs(b - a) > max(MOVED * float(np.sqrt(abs(W - V))), INEXACT * max(abs(a), abs(b)))
    return slower < TOLD and ((moved and slower < AS_SURE * error) or SURER * slower < error)


def every_law(found: Rows, *, linear: bool) -> list[Law]:
    """Laws that all records share, and each with own coefficients by record."""
    shared = list(laws(found.motion, linear=linear))
    return [*shared, *apart(found.motion, shared, of_base(LINEAR if linear else ROTARY))]


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
        A = found.of(law, Acting(m.drive, m.drive, m.drive)).T
        if law.family in LINES and _passes_within(found, law, A):
            continue
        beside = np.linalg.norm(A - q @ (q.T @ A), axis=0)
        if bool((beside > APART * np.linalg.norm(A, axis=0)).any()):
            out.append(law)
    return out


def _passes_within(found: Rows, law: Law, columns: Array) -> bool:
    """Whether a line passes within test functions, which leave little of it: what they leave is their own error."""
    m = found.motion
    acts = np.column_stack((law.repeats or law).columns(m, Acting(m.drive, m.drive, m.drive)))
    return float(np.mean(columns**2)) < LEFT**2 * float(np.mean(acts**2))


def given(found: Rows) -> list[Law]:
    """Laws that the plant file declares: of a neighbouring axis."""
    return [links(found.motion)] if found.motion.neighbour else []


def unsure_share(model: Regression, plain: Plain, drive: float) -> float:
    """Share of a row in which friction may act either way, or less than in sliding, and be no more than noise."""
    if "dry_friction" not in model.base:
        return 0.0
    F_d = plain.F_d + float(model.coefficients[model.base.index("dry_friction")])
    return min(STILL * drive / max(abs(F_d), 1e-300), LONG)


def _heaviest(model: Regression, inertia: float) -> float:
    """The largest coefficient of an acceleration, of the fit or the plant file. [kg m² or kg]"""
    found = [inertia, *(model.coefficients[:1].tolist() if "inertia" in model.base else [])]
    for law in model.laws:
        if law.name == "linked_axis":
            found += model.coefficients[model.part(law)][:2].tolist()
    return float(np.max(np.abs(found)))


def _is_given(plant: Measured, recorded: Sequence[Course], found: Rows) -> bool:
    """Whether the drive's torque is no measurement: by a constant voltage it is a function of speed, whatever acts."""
    if plant.plant.drive != "voltage" or any(c.current is not None for c in recorded):
        return False
    u = found.integrate @ np.concatenate([c.drive for c in recorded])
    return float(np.ptp(np.abs(u))) < CONSTANT * float(np.abs(u).max(initial=0.0))
