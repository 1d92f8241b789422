"""Laws whose coefficients are another in each record: what benches share is fitted once, and the rest by record.

Of inertia, dry friction and drag, which always act, the columns are what a record has more than the mean of all. Of
every other law they are its own columns, once for each record.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from ema.core.records import Array
from ema.discrepancy.axis.balance.laws.law import BY_RECORD, BY_RECORD_NAME, Acting, Law
from ema.discrepancy.axis.balance.laws.motion import Motion

DIFFERS = {  # what may be another in each record without contradicting a cause, and why
    "inertia": "another load on the axis",
    "dry_friction": "temperature, wear or a load across the axis",
    "viscous_drag": "temperature",
    "constant_load": "another load, or a zero of the drive",
    "spring_load": "another zero of the angle or another cable",
    "friction_drift": "how warm it was at the start",
    "viscous_drift": "how warm it was at the start",
}
_Column = Callable[[Motion], Array]
_ACTS: Mapping[str, tuple[_Column, bool]] = {
    "inertia": (lambda m: m.a, False),
    "dry_friction": (lambda m: m.direction, True),
    "viscous_drag": (lambda m: m.w, True),
}


def apart(m: Motion, shared: list[Law], units: Mapping[str, str]) -> Iterator[Law]:
    """The laws by record; none where there is one record. `units`: of inertia, dry friction and drag."""
    if len(m.records) < 2:
        return
    for name, (column, is_friction) in _ACTS.items():
        yield _beside_mean(name, column, units[name], is_friction=is_friction, records=m.records)
    for law in shared:
        yield by_record(law, len(m.records))


def by_record(law: Law, n_records: int) -> Law:
    """A law with own coefficients in each record, in the order of records; `values` are of their mean."""

    def columns(m: Motion, acting: Acting) -> tuple[Array, ...]:
        shared = law.columns(m, acting)
        return tuple((m.record == k) * own for k in range(n_records) for own in shared)

    return replace(
        law,
        family=law.family + BY_RECORD,
        key=law.key + BY_RECORD,
        name=law.name + BY_RECORD_NAME,
        columns=columns,
        values=lambda c: law.values(c.reshape(n_records, -1).mean(axis=0)),
        sentence="on average of the records, and another in each: " + law.sentence,
        n_columns=n_records * law.n_columns,
        repeats=law,
        finer=None,
        among=None,
    )


def _beside_mean(name: str, column: _Column, unit: str, *, is_friction: bool, records: tuple[str, ...]) -> Law:
    """What each record but the last has more than the mean of all; the last has less by the sum of these."""
    last = len(records) - 1

    def columns(m: Motion, _: Acting) -> tuple[Array, ...]:
        own = column(m)
        return tuple(((m.record == k).astype(float) - (m.record == last)) * own for k in range(last))

    def values(c: Array) -> Mapping[str, float]:
        return {"spread": float(np.ptp(np.append(c, -c.sum())))}

    said = name.replace("_", " ").replace("viscous ", "")
    return Law(
        name + BY_RECORD,
        name + BY_RECORD,
        name + BY_RECORD_NAME,
        columns,
        {"spread": unit},
        values,
        f"{said} differs between the records by up to {{spread:.3g}} {unit}",
        f"the same motion again, with nothing changed but {DIFFERS[name]}",
        is_friction=is_friction,
        n_columns=last,
    )
