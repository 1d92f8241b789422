"""Rows of the regression: the balance integrated against test functions, in blocks that can be held out."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

if TYPE_CHECKING:
    from ema.core.records import Array
    from ema.discrepancy.axis.balance.laws.law import Acting, Law
    from ema.discrepancy.axis.balance.laws.motion import Motion

SHOWN = 0.03  # of a column's size that those before it must leave


@dataclass(frozen=True)
class Rows:
    """Rows of the regression.

    Attributes
    ----------
    y, drive, alpha : arrays, shape (n_rows,)
        What is to be explained, the drive's torque [N m or N], and the acceleration [rad/s² or m/s²].
    integrate, differentiate : sparse arrays, shape (n_rows, n_samples)
        ∫ φ f dt and -∫ φ' f dt of what is known at the samples.
    block : array of int, shape (n_rows,)
        Which block a row lies in. Rows that lie across two have a `whole` of False: they are fitted, not held out.
    cluster : array of int, shape (n_rows,)
        The same in shorter pieces: rows of two of them have next to nothing in common.
    sigma : array, shape (n_rows,)
        Noise of y - J α at the plant file's inertia.
    half : float
        Half width of the test functions. [s]
    """

    motion: Motion
    y: Array
    drive: Array
    alpha: Array
    integrate: csr_array
    differentiate: csr_array
    block: NDArray[np.int_]
    whole: NDArray[np.bool_]
    cluster: NDArray[np.int_]
    record: NDArray[np.int_]
    sigma: Array
    half: float
    known: dict[str, Array] = field(default_factory=dict)

    def of(self, law: Law, acting: Acting) -> Array:
        """Columns of a law over the rows, shape (n_columns, n_rows).

        Those that do not depend on what else acts are integrated once.
        """
        if law.repeats is not None:  # no row lies across two records
            own = self.of(law.repeats, acting)
            return np.concatenate([own * (self.record == k) for k in range(len(self.motion.records))])
        if law.needs_acting:
            return np.stack([self.integrate @ column for column in law.columns(self.motion, acting)])
        if law.key not in self.known:
            parts = (
                law.weak(self.motion) if law.weak else [(column, None) for column in law.columns(self.motion, acting)]
            )
            self.known[law.key] = np.stack(
                [
                    self.integrate @ column + (0.0 if momentum is None else self.differentiate @ momentum)
                    for column, momentum in parts
                ]
            )
        return self.known[law.key]

    @cached_property
    def base(self) -> dict[str, Array]:
        """Columns of what always acts, inertia, dry friction and drag: those that the motions can show."""
        m = self.motion
        parts = {
            "inertia": self.alpha,
            "dry_friction": self.integrate @ m.direction,
            "viscous_drag": self.integrate @ m.w,
        }
        kept: dict[str, Array] = {}
        for name, column in parts.items():
            size = float(np.linalg.norm(column))
            if size == 0.0:
                continue
            other = np.column_stack(list(kept.values())) if kept else np.zeros((len(column), 1))
            beside = column - other @ np.linalg.lstsq(other, column, rcond=None)[0]
            if float(np.linalg.norm(beside)) > SHOWN * size:
                kept[name] = column
        return kept

    @property
    def n_blocks(self) -> int:
        """Number of blocks."""
        return int(self.block.max()) + 1 if len(self.block) else 0
