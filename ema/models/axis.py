"""The axis model: simulate windows of records with the recorded drive and start states."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ema.effects import friction_memory, registry
from ema.effects.torque_term import COLUMNS, NEUTRAL

from . import axis_kernel as kernel
from .axis_config import INSTANCE, LINES, Axis
from .axis_layout import N_ROWS, row
from .lag import follow, precede

Array = NDArray[np.float64]
MODES = {
    "current": kernel.CURRENT,
    "voltage": kernel.VOLTAGE,
    "force": kernel.FORCE,
    "speed-loop": kernel.SPEED_LOOP,
}
BETWEEN = {
    **{"straight": kernel.STRAIGHT, "held": kernel.HELD, "held before": kernel.HELD_BEFORE},
    **{"fast": kernel.FAST, "analogue": kernel.ANALOGUE},
}
Effects = Mapping[str, Mapping[str, float]]
State = tuple[float, ...]


@dataclass(frozen=True)
class Model:
    """Numbers of one axis, ready for the kernel: parameter array, lines of torque, unnamed terms."""

    z: Array
    lines: Array
    terms: Array

    @property
    def inertia(self) -> float:
        """The mean over the angle. [kg m² or kg]"""
        return float(self.z[row("J")] * (1.0 + self.z[row("inertia.change")]))


def model(
    plant: Axis,
    effects: Effects | None = None,
    structure: Sequence[Mapping[str, float]] = (),
    **changed: float,
) -> Model:
    """Numbers for `plant` with further effects and terms; keyword arguments replace parameters (``F_d=0.1``).

    A changed F_d takes F_s with it: their ratio stays.
    """
    z = np.zeros(N_ROWS)
    ratio = plant.F_s / plant.F_d if plant.F_s is not None and plant.F_d > 0.0 else 1.0
    values: dict[str, float | None] = {
        **{"J": plant.inertia, "C": plant.C, "F_d": plant.F_d, "F_s": plant.F_s},
        **{"k_t": plant.k_t, "k_e": plant.k_e, "R": plant.R, "L": plant.L, "V_dc": plant.V_dc},
        **({"K_w": plant.loop.K_w, "I_max": plant.loop.I_max} if plant.loop else {}),
    }
    values |= {"J" if name == "M" else name: value for name, value in changed.items()}
    if "F_d" in changed or values["F_s"] is None:
        values["F_s"] = ratio * float(values["F_d"] or 0.0)
    if values["k_t"] is None or plant.is_force:
        values["k_t"] = 1.0
    for name, value in values.items():
        z[row(name)] = 0.0 if value is None else value
    for name, effect in registry().items():
        if "axis" in effect.plants:
            for parameter in effect.parameters:
                z[row(f"{name}.{parameter.name}")] = parameter.neutral
    merged: dict[str, Mapping[str, float]] = {**plant.effects, **(effects or {})}
    lines = []
    for key, given in merged.items():
        name = key.split(INSTANCE)[0]
        if name in LINES:
            full = {**registry()[name].neutral(), **given}
            lines.append([full["amplitude"], full["order"], full["phase"]])
            continue
        for parameter_name, number in given.items():
            z[row(f"{name}.{parameter_name}")] = number
    neutral = dict(zip(COLUMNS, NEUTRAL, strict=True))
    terms = [[{**neutral, **term}[name] for name in COLUMNS] for term in (*plant.structure, *structure)]
    return Model(z, np.array(lines).reshape(-1, 3), np.array(terms).reshape(-1, len(COLUMNS)))


def simulate(
    numbers: Model,
    drive: str,
    offsets: NDArray[np.int64],
    t: Array,
    recorded: Array,
    starts: Array,
    h_max: float,
    dT: Array | None = None,
    slide: Array | None = None,
    between: str = "straight",
    bristles: Array | None = None,
    load: Array | None = None,
) -> Array:
    """Outputs (4, n_times) of all windows: position, speed, current, voltage as the sensors show them.

    Parameters
    ----------
    drive : str
        What `recorded` is: current, voltage, force, or (speed-loop) commanded speed.
    offsets : array, shape (n_windows + 1,)
        Window j is samples ``offsets[j]:offsets[j + 1]``.
    starts : array, shape (n_windows, 4)
        True position and speed at each window's first sample, and by how much what is beyond a gear that gives is
        behind in position and speed.
    dT : array, shape (n_windows,), optional
        Winding temperature less 20 °C. [K]
    slide : array, shape (n_windows,), optional
        ±1 where the axis slides that way throughout the window, 0 where it may rest or turn round.
    between : str
        What the drive does from one sample to the next: runs straight, is held, or is that of the next (held before).
        A speed loop acts once a sample, or (fast) between samples too, (analogue) on a command that runs straight.
    bristles : array, shape (n_windows,), optional
        Share of dry friction, -1…1, that is built up where a window begins; all of it where not given.
    load : array, shape (n_times,), optional
        Torque of a known load against positive motion; straight from sample to sample. [N m or N]
    """
    bristles = np.sign(starts[:, 1]) if bristles is None else bristles
    starts = np.column_stack([starts, bristles])
    slide = np.zeros(len(starts)) if slide is None else slide
    dT = np.zeros(len(starts)) if dT is None else dT
    out = np.empty((len(kernel.OUTPUTS), len(t)))
    model = (numbers.z, numbers.lines, numbers.terms, MODES[drive], BETWEEN[between])
    kernel.simulate_windows(*model, offsets, t, recorded, _known(load, t), starts, slide, dT, h_max, out)
    return out


def _known(load: Array | None, t: Array) -> Array:
    return np.zeros(len(t)) if load is None else load


def lag_of_drive(numbers: Model, drive: str) -> float:
    """Time constant with which what acts follows the recorded `drive`, by the clock of the record. [s]

    Below zero it is that with which the recorded drive follows what acts. A commanded speed acts at once: what lags
    there is the current within the loop.
    """
    if drive == "speed-loop":
        return 0.0
    lag, of_filter = (numbers.z[row(f"{name}.time")] for name in ("drive_lag", "drive_filter"))
    return float((lag - of_filter) / (1.0 + numbers.z[row("clock_skew.rate")]))


def clock_of_drive(numbers: Model) -> tuple[float, float]:
    """By what share the interval of the drive's samples is off, and how late they are taken after the rest. [1, s]"""
    return float(numbers.z[row("clock_skew.currents")]), float(numbers.z[row("clock_skew.late")])


def acting_drive(lag: float, t: Array, recorded: Array, between: str = "straight") -> Array:
    """What acts of a recorded drive that is followed with a time constant, or follows; arguments as in `simulate`."""
    if lag < 0.0:
        return precede(t, recorded, -lag)
    return follow(t, recorded, lag, BETWEEN[between]) if lag > 0.0 else recorded


def holding(numbers: Model, theta: Array, direction: Array, t: Array, load: Array | None = None) -> Array:
    """Current that holds the axis with a `load` at measured `theta`, approached in `direction`; of one shape. [A]"""
    out = np.empty(len(theta))
    true = true_state(numbers, np.stack([theta, np.zeros(len(theta))], axis=1), derived=False)[:, 0].copy()
    kernel.holding_current(numbers.z, numbers.lines, numbers.terms, true, direction, t, _known(load, t), out)
    return out


def is_flexible(numbers: Model) -> bool:
    """Whether the gear gives or has play, so that a window also begins with a twist."""
    springs = (numbers.z[row(f"{name}.compliance")] for name in ("gear_compliance", "drive_compliance"))
    return has_play(numbers) or bool(max(springs) > 0.0)


def has_play(numbers: Model) -> bool:
    """Whether the gear has play."""
    return bool(numbers.z[row("gear_play.gap")] > 0.0)


def beyond_after(
    numbers: Model,
    drive: str,
    offsets: NDArray[np.int64],
    t: Array,
    theta: Array,
    w: Array,
    recorded: Array,
    follows: NDArray[np.bool_],
    h_max: float,
    between: str = "straight",
    load: Array | None = None,
) -> Array:
    """Position and speed of what is beyond a gear, shape (n, 2), at the end of each recorded motion.

    Parameters
    ----------
    offsets : array, shape (n + 1,)
        Motion j is samples ``offsets[j]:offsets[j + 1]`` of `t`, `theta`, its speed `w` and the `recorded` drive.
    follows : array of bool, shape (n,)
        Whether a motion begins where the one before it ended; else it begins untwisted, as fast as what is measured.
    """

    known = _known(load, t)

    def along(of: slice, beyond: State) -> State:
        how = (numbers.z, MODES[drive], BETWEEN[between])
        return kernel.beyond_after(*how, t[of], theta[of], recorded[of], known[of], h_max, *beyond)

    return _after(offsets, follows, lambda first: (theta[first], w[first]), along)


def _after(
    offsets: NDArray[np.int64],
    follows: NDArray[np.bool_],
    begin: Callable[[int], State],
    along: Callable[[slice, State], State],
) -> Array:
    """The state, shape (n, n_states), at the end of each motion; one that follows begins where the last one ended."""
    out: list[State] = []
    for j, (first, end) in enumerate(itertools.pairwise(offsets.tolist())):
        out.append(along(slice(first, end), out[-1] if follows[j] and out else begin(first)))
    return np.array(out)


def has_memory(numbers: Model) -> bool:
    """Whether friction has a memory, so that a window also begins with a share of it that is built up."""
    return bool(numbers.z[row("friction_memory.deflection")] > 0.0)


def bristles_after(
    numbers: Model,
    offsets: NDArray[np.int64],
    t: Array,
    theta: Array,
    w: Array,
    follows: NDArray[np.bool_],
    play: float,
) -> Array:
    """Share of friction that is built up at the end of each recorded motion, shape (n,); see `beyond_after`.

    `play`: half width of what is noise of the angle and no way. [rad]
    """

    def along(of: slice, bristle: State) -> State:
        return kernel.bristle_after(numbers.z, theta[of], play, *bristle)

    return _after(offsets, follows, lambda first: (0.0, theta[first], 0.0), along)[:, 0]


def built_up(numbers: Model, share: float, way: float) -> float:
    """Share of friction that is built up after a further way; all of it without a memory. [rad or m]"""
    deflection = float(numbers.z[row("friction_memory.deflection")])
    return float(friction_memory.built_up(share, way, deflection)) if deflection > 0.0 else float(np.sign(way))


def true_state(numbers: Model, measured: Array, *, derived: bool) -> Array:
    """Position and speed behind measured ones (n, 2): the sensors' angle errors undone.

    `derived`: the speed was not measured but taken from the position.
    """
    out = np.empty(measured.shape)
    kernel.undo_angle_error(numbers.z, measured, derived, out)
    return out


def inertia_by_angle(numbers: Model, theta: Array) -> tuple[Array, Array]:
    """What the angle adds to the inertia along a motion, and its slope; shape (n,). [kg m², kg m²/rad]"""
    out = np.empty((2, len(theta)))
    kernel.inertia_by_angle(numbers.z, theta, out)
    return out[0], out[1]


def torque_along(
    numbers: Model,
    theta: Array,
    w: Array,
    i: Array,
    t: Array,
    dT: Array,
    load: Array | None = None,
    *,
    force: bool = False,
) -> Array:
    """Torque that changes the momentum along a measured motion, with a known `load`; of one shape. [N m or N]"""
    out = np.empty(len(theta))
    kernel.torque_along(numbers.z, numbers.lines, numbers.terms, theta, w, i, t, dT, _known(load, t), force, out)
    return out
