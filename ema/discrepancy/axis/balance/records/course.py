"""Each cycle as it was recorded: time stamps as they are, position, speed, and what the drive gives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ema.effects.base import T_REFERENCE

if TYPE_CHECKING:
    from ema.core.records import Array, Cycle
    from ema.discrepancy.axis.reading.measured import Measured
    from ema.discrepancy.axis.reading.windows import Bench, Window

LATE = {"held": 0.5, "held before": -0.5}  # samples, by what the drive does between them
MOST = 60_000  # samples of all cycles together; of longer ones means of neighbours are taken


@dataclass(frozen=True)
class Course:
    """One cycle, arrays of shape (n_times,).

    `dT` is the winding's temperature less 20 °C [K].
    `drive` is the channel that drives, `current` the measured current beside a driving voltage; `position` or `speed`
    is None where it was not recorded. `noise` is the rms of each by channel name. A `static` course holds readings at
    rest, each approached in `direction`. `late`: samples by which the drive acts later than its channel says (one that
    is held from sample to sample: half a sample). `other`: angle of a neighbouring axis. `zero`: angle to be added to
    the positions. `load`: torque of a known load, 0 where none was recorded.
    """

    record: str
    bench: Bench
    t: Array
    drive: Array
    position: Array | None
    speed: Array | None
    current: Array | None
    dT: Array
    load: Array
    noise: dict[str, float]
    static: bool = False
    direction: Array | None = None
    late: float = 0.0
    other: Array | None = None
    zero: float = 0.0

    @property
    def period(self) -> float:
        """Median time between samples. [s]"""
        return float(np.median(np.diff(self.t)))

    def disturbed(self, rng: np.random.Generator) -> Course:
        """The same with once more the noise it has."""

        def more(x: Array | None, name: str) -> Array | None:
            return None if x is None else x + self.noise.get(name, 0.0) * rng.standard_normal(len(x))

        drive, load = more(self.drive, "drive"), more(self.load, "load")
        assert drive is not None
        assert load is not None
        return replace(
            self,
            drive=drive,
            position=more(self.position, "position"),
            speed=more(self.speed, "speed"),
            current=more(self.current, "current"),
            other=more(self.other, "position"),
            load=load,
        )


def courses(plant: Measured) -> list[Course]:
    """Every cycle of every record."""
    n = sum(cycle.n_samples for record in plant.records for cycle in record)
    every = max(1, -(-n // MOST))
    late = LATE.get(plant.between, 0.0) / every
    out: list[Course] = []
    for b, record in zip(plant.benches, plant.records, strict=True):
        for cycle in record:
            if b.static:
                out += _static(b)
                break
            if cycle.n_samples >= 40:
                out.append(_moving(b, cycle, every, late))
    return out


def _moving(b: Bench, cycle: Cycle, every: int, late: float) -> Course:
    who = b.roles
    m = cycle.n_samples // every * every

    def of(name: str | None) -> Array | None:
        if name is None or name not in cycle:
            return None
        return np.asarray(cycle[name][:m].reshape(-1, every).mean(axis=1))

    t, drive = of("t"), of(who.drive)
    assert t is not None
    assert drive is not None
    current = "i_q" if who.kind == "voltage" and "i_q" in who.outputs else None
    names = {"drive": who.drive, "position": who.position, "speed": who.speed, "current": current, "load": who.load}
    noise = {role: b.noise[name].sigma / every**0.5 for role, name in names.items() if name in b.noise}
    warm = of("temp_w")
    dT = np.zeros(len(t)) if warm is None else warm - T_REFERENCE
    load = of(who.load)
    load = np.zeros(len(t)) if load is None else load
    measured = (drive, of(who.position), of(who.speed), of(current))
    return Course(b.name, b, t, *measured, dT, load, noise, late=late, other=of("theta_n"))


def _static(b: Bench) -> list[Course]:
    noise = {"drive": b.noise[b.roles.drive].sigma, "load": b.load_noise}

    def course(w: Window) -> Course:
        measured = (w.drive, w.position, np.zeros(w.n), None)
        return Course(b.name, b, w.t, *measured, np.full(w.n, w.dT), w.load, noise, True, w.direction)

    return [course(w) for w in b.windows]
