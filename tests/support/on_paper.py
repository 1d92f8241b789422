"""A motor whose motion is written down and whose current is what that motion takes: no simulation has a part in it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ema.core.records import Cycle, Record
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import RotaryAxis

Array = NDArray[np.float64]
J, C, F_D, K_T = 2e-4, 3e-4, 0.01, 0.05
RATE, DURATION = 1000.0, 6.0
NOISE = {"theta_m": 1e-5, "w_m": 5e-3, "i_q": 2e-3}


@dataclass(frozen=True)
class Swing:
    """Angle, speed, acceleration (n_times,) of a sum of sines: amplitude [rad], frequency [rad/s], phase."""

    parts: Sequence[tuple[float, float, float]] = ((2.5, 2.3, 0.3), (0.6, 7.1, 1.1))

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        x, w, a = np.zeros(len(t)), np.zeros(len(t)), np.zeros(len(t))
        for A, f, phase in self.parts:
            x += A * np.sin(f * t + phase)
            w += A * f * np.cos(f * t + phase)
            a -= A * f**2 * np.sin(f * t + phase)
        return x, w, a


Opposing = Callable[[Array, Array, Array], Array]  # t, angle, speed → torque against the motor, (n_times,) [N m]


def nothing(t: Array, theta: Array, w: Array) -> Array:
    """No torque that the plant file does not have."""
    return np.zeros(len(t))


def cycle(opposing: Opposing = nothing, seed: int = 1, swing: Swing | None = None, **more: float) -> Cycle:
    """One cycle; `more` are other values of J, C, F_D, the angle's `zero`, and how many times the usual `noise`."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, DURATION, 1.0 / RATE)
    theta, w, a = (swing or Swing()).at(t)
    tau = more.get("J", J) * a + more.get("C", C) * w + more.get("F_D", F_D) * np.sign(w) + opposing(t, theta, w)
    true = {"theta_m": theta + more.get("zero", 0.0), "w_m": w, "i_q": tau / K_T}
    noise = {name: more.get("noise", 1.0) * sigma * rng.standard_normal(len(t)) for name, sigma in NOISE.items()}
    return Cycle(0, {"t": t, **{name: x + noise[name] for name, x in true.items()}})


def plant(*cycles: Cycle, **plant_file: object) -> AxisPlant:
    """The axis with one record for each cycle."""
    own = RotaryAxis.model_validate({"J": J, "C": C, "F_d": F_D, "k_t": K_T, **plant_file})
    return AxisPlant(own, [Record((c,), source=Path(f"{k}.csv")) for k, c in enumerate(cycles)], n_threads=1)


def everywhere(made: AxisPlant) -> range:
    """All its windows."""
    return range(len(made.windows))
