"""Cogging beside a torque of the same orders that comes from outside the motor.

One record does not tell them: both are locked to the rotor, and neither scales with the current. A motor's own cogging
has the orders of its slots and poles, and is the same in every record; a neighbour may go, or stand on the other side.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy import stats

from ema.core.records import Array
from ema.discrepancy import findings as shared
from ema.effects import registry

if TYPE_CHECKING:
    from ema.discrepancy.axis.balance.regressing.agreement import Agreement
    from ema.discrepancy.axis.finding.plant import AxisPlant

NAME, ANOTHER_ZERO = "external_torque", "another_zero"
NEIGHBOUR = 0.05  # probability that a motor whose own orders are not known has magnets beside it
ALIKE = 0.01  # p above which all records but one agree
SAME_SIZE = 0.1  # of an amplitude, that a record may differ by where its zero alone is another


def add_external(plant: AxisPlant, found: Sequence[shared.FoundEffect]) -> list[shared.FoundEffect]:
    """Causes with the external torque beside cogging, or named with the records where lines of torque differ."""
    apart = _apart(plant)
    orders = {a.order for a in apart}
    kept = [e for e in found if not (e.name == "cogging" and e.parameters["order"].value in orders)]
    return [*(_beside(plant, e) for e in kept), *(_named(a) for a in apart)]


def find_own_order(plant: AxisPlant) -> int | None:
    """The order of which a sound motor's cogging has multiples; None where slots and poles are not declared."""
    p, slots = getattr(plant.plant, "p", None), getattr(plant.plant, "slots", None)
    return math.lcm(slots, 2 * p) if p and slots else None


def _beside(plant: AxisPlant, e: shared.FoundEffect) -> shared.FoundEffect:
    """Cogging at an order that need not be the motor's own."""
    if e.name != "cogging" or e.indistinguishable_from or plant.plant.is_linear:
        return e
    own, order = find_own_order(plant), e.parameters["order"].value
    if own is not None and order % own == 0.0:
        return e
    share = NEIGHBOUR if own is None else 0.5
    reason = "" if own is None else f": a sound motor of these slots and poles cogs at multiples of {own} only"
    return replace(
        e,
        confidence=round((1.0 - share) * e.confidence, 4),
        of_others=round(share * e.confidence, 4),
        indistinguishable_from=(NAME,),
        sentence=f"{e.sentence}, or a torque from outside the motor (a neighbour's magnets){reason}",
        separated_by=f"{e.separated_by}; {registry()[NAME].separated_by}",
    )


@dataclass(frozen=True)
class _Apart:
    """A line of torque that differs between records.

    Attributes
    ----------
    values : array, shape (n_records, 2)
        Cosine and sine part. [N m]
    alone : int or None
        The record that differs from all others, which agree.
    is_shift : bool
        Whether another zero of the angle would do: the line is of one size everywhere, and the others go with it.
    """

    order: float
    records: tuple[str, ...]
    values: Array
    covariance: Array
    sure: float
    alone: int | None
    is_shift: bool


def _apart(plant: AxisPlant) -> list[_Apart]:
    """Lines on which records contradict each other, by what the balance says of them."""
    b = plant.balance
    if b is None or len(plant.benches) < 2 or plant.plant.is_linear:
        return []
    records, turned = b.model.rows.motion.records, plant.zeros.values()
    out = []
    for a in b.agreements:
        if a.name != "cogging" or a.law is None or a.is_one(len(b.agreements)):
            continue
        order = a.law.values(a.values.ravel())["order"]
        differs = 1.0 - min(a.odds, 0.5)
        is_shift = _is_shift(a) and not any(order in zero.turned and zero.instead is None for zero in turned)
        out.append(_Apart(order, records, a.values, a.covariance, differs, _alone(a), is_shift))
    return out


def _alone(a: Agreement) -> int | None:
    """The one record without which the others agree; None where there is none, or more than one."""
    n = len(a.values)
    rest = [[j for j in range(n) if j != k] for k in range(n)]
    alike = [k for k in range(n) if n > 2 and _p(a.values[rest[k]], a.covariance[rest[k]]) > ALIKE]
    return alike[0] if len(alike) == 1 else None


def _p(values: Array, covariance: Array) -> float:
    """p of one value behind all."""
    size = SAME_SIZE**2 * float(np.mean(np.sum(values**2, axis=1)))
    weight = np.linalg.inv(covariance + size * np.eye(values.shape[1]))
    mean = np.linalg.solve(weight.sum(axis=0), np.einsum("kij,kj->i", weight, values))
    d = values - mean
    return float(stats.chi2.sf(np.einsum("ki,kij,kj->", d, weight, d), d.size - len(mean)))


def _is_shift(a: Agreement) -> bool:
    size = np.linalg.norm(a.values, axis=1)
    sd = np.sqrt(np.trace(a.covariance, axis1=1, axis2=2) / 2.0)
    return bool(np.ptp(size) < shared.WITHIN * float(np.hypot(*np.sort(sd)[-2:])) + SAME_SIZE * size.max())


def _named(a: _Apart) -> shared.FoundEffect:
    """The external torque as the largest step between records, or that of the one that differs."""
    i, j = _step(a)
    c = a.values[j] - a.values[i]
    A = float(np.hypot(*c))
    sd = float(np.sqrt(np.trace(a.covariance[i] + a.covariance[j]) / 2.0))
    spread, turn = shared.WITHIN * sd, shared.WITHIN * sd / A
    phase = float(np.arctan2(c[0], c[1]))
    sizes = ", ".join(
        f"{np.hypot(*v):.3g} N m at phase {np.arctan2(v[0], v[1]):+.2f} rad in {name}"
        for name, v in zip(a.records, a.values, strict=True)
    )
    where = f"acts in {a.records[a.alone]} and in no other" if a.alone is not None else "differs between the records"
    turned = float(a.values[i] @ a.values[j]) < -0.5 * float(np.prod(np.linalg.norm(a.values[[i, j]], axis=1)))
    return shared.FoundEffect(
        NAME,
        round(a.sure / (1 + a.is_shift), 4),
        (ANOTHER_ZERO,) if a.is_shift else (),
        {
            "amplitude": shared.Quantity(A, max(A - spread, 0.0), A + spread, "N m"),
            "order": shared.Quantity(a.order, a.order, a.order, "1/turn"),
            "phase": shared.Quantity(phase, phase - turn, phase + turn, "rad"),
        },
        f"a rotor-locked torque of {a.order:g} periods per turn from outside the motor (a neighbour's magnets, "
        f"crosstalk) {where}: {sizes}{'; it turns round' if turned else ''}"
        + ("; another zero of the angle would look the same" if a.is_shift else ""),
        registry()[NAME].separated_by,
        in_every_record=False,
    )


def _step(a: _Apart) -> tuple[int, int]:
    """Two records: the largest step, or to the one that stands alone; the smaller line first."""
    if a.alone is not None:
        others = [k for k in range(len(a.values)) if k != a.alone]
        return min(others, key=lambda k: float(np.trace(a.covariance[k]))), a.alone
    distance = np.linalg.norm(a.values[:, None] - a.values[None], axis=2)
    i, j = np.unravel_index(int(np.argmax(distance)), distance.shape)
    size = np.linalg.norm(a.values, axis=1)
    return (int(i), int(j)) if size[i] <= size[j] else (int(j), int(i))
