"""An axis as free runs found it: what the balance of torque still needs beside that.

The balance knows no sensors and no electrical side. What a motor that saturates does not give, or a clock that is off
makes of an acceleration, is a law of friction to it, by load or by speed; so a law is named beside what free runs found
only where it is missing with that in the model.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ema.core.records import Array, Cycle
from ema.discrepancy.axis.balance.records.of_records import balance
from ema.discrepancy.axis.balance.regressing.found import Balance
from ema.discrepancy.axis.naming.naming import OF_MOTION, numbers_of
from ema.discrepancy.plant import Point
from ema.models import axis

if TYPE_CHECKING:
    from ema.discrepancy.axis.finding.plant import AxisPlant
    from ema.discrepancy.axis.reading.windows import Bench

OF_SENSORS = (*OF_MOTION, "clock_skew", "drive_lag", "drive_filter")


def balance_beside(plant: AxisPlant, point: Point) -> Balance | None:
    """The balance of the records with the parameters and effects of `point` in the model, and its sensors undone."""
    return balance(_Extended(plant, point))


class _Extended:
    """The same axis with other numbers, as `measured.Measured`."""

    def __init__(self, plant: AxisPlant, point: Point):
        self._of = plant
        found = numbers_of(point)
        known = {name: value for name, value in found.parameters.items() if hasattr(plant.plant, name)}
        if plant.plant.F_s is not None and plant.plant.F_d > 0.0 and "F_d" in known:
            known["F_s"] = plant.plant.F_s / plant.plant.F_d * known["F_d"]  # as in a fit
        self.plant = plant.plant.model_copy(update=known)
        self._acting = {
            name: value for name, value in point.items() if not name.startswith((*OF_SENSORS, "term", "zero"))
        }
        self._late = {name: own.get("time", 0.0) for name, own in found.effects.items()}
        self._clock = found.effects.get("clock_skew", {}).get("rate", 0.0)
        self._sensors = plant.model(point)
        self.between, self.benches, self.windows = plant.between, plant.benches, plant.windows
        self.zeros, self.base, self.bench_of, self.residuals = plant.zeros, plant.base, plant.bench_of, plant.residuals
        self.plays, self.left_by_balance = plant.plays, plant.left_by_balance
        pairs = zip(plant.benches, plant.records, strict=True)
        self.records = tuple(replace(r, cycles=tuple(self._undone(b, c) for c in r.cycles)) for b, r in pairs)

    def model(self, point: Point) -> axis.Model:
        """With what was found, whatever the point."""
        return self._of.model({**self._acting, **point})

    def _undone(self, b: Bench, c: Cycle) -> Cycle:
        """The cycle as sound sensors would have shown it."""
        channels, t = dict(c.channels), c["t"]
        for name, effect in ((b.roles.position, "position_delay"), (b.roles.speed, "speed_delay")):
            if name and self._late.get(effect):
                channels[name] = np.interp(t + self._late[effect], t, c[name])
        lag = axis.lag_of_drive(self._sensors, b.roles.kind)
        channels[b.roles.drive] = axis.acting_drive(lag, t, c[b.roles.drive], self.between)
        if b.roles.position:
            channels |= self._straight(b, channels)
        channels["t"] = t[0] + (t - t[0]) * (1.0 + self._clock)
        return Cycle(c.number, channels, c.label)

    def _straight(self, b: Bench, channels: dict[str, Array]) -> dict[str, Array]:
        """Position and speed without the error of the angle."""
        theta = channels[str(b.roles.position)]
        w = channels[b.roles.speed] if b.roles.speed else np.zeros(len(theta))
        true = axis.true_state(self._sensors, np.stack([theta, w], axis=1), derived=b.roles.speed is None)
        return {str(b.roles.position): true[:, 0], **({b.roles.speed: true[:, 1]} if b.roles.speed else {})}
