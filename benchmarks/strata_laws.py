"""Laws of a warm, geared, compliant axis under cascaded loops, hidden one at a time: see `strata_axis`.

Sizes are drawn so that a law takes a share of the torque that a test engineer would ask about. The simulation
(tests/support/geared.py) shares no code with the library, and has other forms where physics allows: Arrhenius for an
exponential, a first-order filter for a delay, bristles for a way.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import geared
import numpy as np

from ema.core.records import Cycle, Record

MESH = 17.0 * 85.0 / 102.0
GEAR = {"gear": 6.0, "gear_kind": "planetary", "teeth": (17, 85)}
Rng = np.random.Generator


@dataclass(frozen=True)
class Hidden:
    """An axis with something in it.

    Attributes
    ----------
    axis : geared.Axis
    truth : dict
        Exact values by effect and parameter, where the simulation has the library's law.
    effects : tuple of str
        Of the library, where `truth` does not name them.
    spoil : function Record → Record
        What a sensor or a recorder does to it.
    plant_file : dict
        What the plant file says beside.
    others : tuple of geared.Axis
        Of further records, given together with the first.
    """

    axis: geared.Axis
    truth: Mapping[str, float] = field(default_factory=dict)
    effects: tuple[str, ...] = ()
    spoil: Callable[[Record], Record] = lambda record: record
    plant_file: Mapping[str, Any] = field(default_factory=dict)
    others: tuple[geared.Axis, ...] = ()
    is_warm: bool = False


def hidden(name: str, axis: geared.Axis, rng: Rng) -> Hidden:
    """The axis with one law in it, of a drawn size."""
    found = HIDDEN[name](axis, rng)
    return found if found.effects else replace(found, effects=(name,))


def _warm(rng: Rng) -> tuple[float, float, float]:
    return 20.0, 20.0 + rng.uniform(25.0, 45.0), rng.uniform(1.5, 4.0)


def _sign(rng: Rng) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _memory(a: geared.Axis, rng: Rng) -> Hidden:
    return Hidden(replace(a, bristle=10.0 ** rng.uniform(-1.7, -0.4)))


def _dry_by_temperature(a: geared.Axis, rng: Rng) -> Hidden:
    k = rng.uniform(0.008, 0.02)
    return Hidden(replace(a, dry_per_kelvin=k, warms=_warm(rng)), is_warm=True)


def _viscous_by_temperature(a: geared.Axis, rng: Rng) -> Hidden:
    C = a.F / 0.03 * rng.uniform(0.8e-3, 2e-3)
    return Hidden(
        replace(a, C=C, viscous_activation=rng.uniform(2000.0, 5000.0), warms=_warm(rng)), is_warm=True
    )  # fmt: skip


def _dry_drift(a: geared.Axis, rng: Rng) -> Hidden:
    rate = _sign(rng) * rng.uniform(0.03, 0.06)
    return Hidden(replace(a, dry_rate=rate), {"friction_drift.rate": rate})


def _viscous_drift(a: geared.Axis, rng: Rng) -> Hidden:
    C, rate = a.F / 0.03 * rng.uniform(0.8e-3, 2e-3), _sign(rng) * rng.uniform(0.04, 0.07)
    return Hidden(replace(a, C=C, viscous_rate=rate), {"viscous_drift.rate": C * rate})


def _flux_by_temperature(a: geared.Axis, rng: Rng) -> Hidden:
    k = -rng.uniform(0.0009, 0.0015)
    warms = (20.0, rng.uniform(90.0, 120.0), rng.uniform(1.5, 4.0))
    return Hidden(replace(a, flux_per_kelvin=k, warms=warms), effects=("magnet_flux",), is_warm=True)


def _square_of_motor(a: geared.Axis, rng: Rng) -> Hidden:
    c = rng.uniform(0.05, 0.12) / a.F  # of more a motor could not move what its own torque presses
    return Hidden(replace(a, by_square=c), {"quadratic_load_friction.per_square": c / a.F})


def _hanging(a: geared.Axis, rng: Rng) -> tuple[geared.Axis, dict[str, Any]]:
    """With a load that the plant file knows."""
    gravity = a.F * rng.uniform(1.0, 2.0)
    return replace(a, gravity=gravity), {"effects": {"pendulum": {"amplitude": gravity, "phase": 0.0}}}


def _by_load(a: geared.Axis, rng: Rng) -> Hidden:
    a, declared = _hanging(a, rng)
    share = rng.uniform(0.15, 0.3)
    return Hidden(replace(a, by_load=share), {"output_load_friction.share": share}, plant_file=declared)


def _square_of_load(a: geared.Axis, rng: Rng) -> Hidden:
    a, declared = _hanging(a, rng)
    c = rng.uniform(0.2, 0.4) / a.gravity
    truth = {"quadratic_output_load_friction.per_torque": c}
    return Hidden(replace(a, by_load_square=c), truth, plant_file=declared)


def _pendulum(a: geared.Axis, rng: Rng) -> Hidden:
    gravity = a.F * rng.uniform(0.3, 1.5)
    return Hidden(replace(a, gravity=gravity), {"pendulum.amplitude": gravity})


def _gear_error(a: geared.Axis, rng: Rng) -> Hidden:
    A = a.F * rng.uniform(0.07, 0.3)
    return Hidden(
        replace(a, lines=((A, MESH, rng.uniform(0.0, 6.0)),)), {"gear_error.amplitude": A}, plant_file=GEAR
    )  # fmt: skip


def _cogging(a: geared.Axis, rng: Rng) -> Hidden:
    A = a.F * rng.uniform(0.07, 0.3)
    order = float(rng.choice([12, 18, 24]))
    return Hidden(replace(a, lines=((A, order, rng.uniform(0.0, 6.0)),)), {"cogging.amplitude": A}, plant_file=GEAR)


def _external(a: geared.Axis, rng: Rng) -> Hidden:
    """A neighbour that acts in the second of three records."""
    own = (0.2 * a.F, 12.0, rng.uniform(0.0, 6.0))
    A = a.F * rng.uniform(0.1, 0.2)
    neighbour = (A, float(rng.choice([9, 15])), rng.uniform(0.0, 6.0))
    alone = replace(a, lines=(own,))
    beside = replace(a, lines=(own, neighbour))
    return Hidden(alone, {"external_torque.amplitude": A}, ("external_torque", "cogging"), others=(beside, alone))


def _reads_too_much(a: geared.Axis, rng: Rng) -> Hidden:
    """A torque channel; drag shows it apart from what a lighter axis is."""
    reads = 1.0 + rng.uniform(0.08, 0.2)
    a = replace(a, C=20.0 * a.F / 30.0 * 1e-3, reads=reads)

    def torque(record: Record) -> Record:
        (cycle,) = record.cycles
        channels = dict(cycle.channels)
        channels["torque"] = a.k_t * channels.pop("i_q")
        return Record((Cycle(0, channels),))

    declared = {"drive": "torque", "k_t": None, "C": a.C, "fitted": []}
    truth = {"drive_gain.gain": reads - 1.0}
    return Hidden(a, truth, ("drive_gain",), spoil=torque, plant_file=declared)


def _through(name: str, late: float, noise: float, *, is_held: bool = False) -> Callable[[Record], Record]:
    """A channel through a filter of the first order before it is recorded; one that is held acts from its sample on."""

    def through(record: Record) -> Record:
        (cycle,) = record.cycles
        given = np.append(cycle[name][:1], cycle[name][:-1]) if is_held else cycle[name]
        out = np.empty(cycle.n_samples)
        y, share = float(given[0]), -np.expm1(-cycle.period / late)
        for k, x in enumerate(given):
            y += share * (float(x) - y)
            out[k] = y
        out += noise * np.random.default_rng(cycle.n_samples).standard_normal(len(out))
        return Record((Cycle(0, {**cycle.channels, name: out}),))

    return through


def _filtered_speed(a: geared.Axis, rng: Rng) -> Hidden:
    return Hidden(a, effects=(FILTERED,), spoil=_through("w_m", rng.uniform(3e-3, 1e-2), a.noise[1]))


def _filtered_current(a: geared.Axis, rng: Rng) -> Hidden:
    late = rng.uniform(2e-3, 6e-3)
    return Hidden(a, {"drive_filter.time": late}, spoil=_through("i_q", late, a.noise[2], is_held=True))


def _slope(name: str, field_: str) -> Callable[[geared.Axis, Rng], Hidden]:
    def of(a: geared.Axis, rng: Rng) -> Hidden:
        slope = _sign(rng) * rng.uniform(0.02, 0.05)  # [1/rad], over some ten radians each way
        C = a.F / 0.03 * 1.5e-3 if name == "viscous_slope" else a.C
        return Hidden(replace(a, **{field_: slope, "C": C}), effects=(name,))

    return of


def _unequal(a: geared.Axis, rng: Rng) -> Hidden:
    return Hidden(replace(a, unequal=_sign(rng) * rng.uniform(0.05, 0.15)), effects=("drive_unequal",))


def _hardening(a: geared.Axis, rng: Rng) -> Hidden:
    """A cable that pulls with the cube of the angle too: two to four times as stiff at the ends, some 10 rad away."""
    stiffness = a.F * rng.uniform(0.1, 0.4)  # [N m/rad]
    cube = stiffness * rng.uniform(1.0, 3.0) / (3.0 * 10.0**2)  # [N m/rad^3]
    return Hidden(replace(a, spring=(stiffness, cube)), effects=("stiffening_spring",))


def _slow_current(a: geared.Axis, rng: Rng) -> Hidden:
    lag = rng.uniform(2e-3, 6e-3)
    return Hidden(replace(a, lag=lag), {"drive_lag.time": lag})


FILTERED = "speed_delay"
HIDDEN: dict[str, Callable[[geared.Axis, Rng], Hidden]] = {
    "friction_memory": _memory,
    "friction_by_temperature": _dry_by_temperature,
    "viscous_by_temperature": _viscous_by_temperature,
    "friction_drift": _dry_drift,
    "viscous_drift": _viscous_drift,
    "flux_by_temperature": _flux_by_temperature,
    "quadratic_load_friction": _square_of_motor,
    "output_load_friction": _by_load,
    "quadratic_output_load_friction": _square_of_load,
    "pendulum": _pendulum,
    "gear_error": _gear_error,
    "cogging": _cogging,
    "external_torque": _external,
    "torque_reads_too_much": _reads_too_much,
    "speed_filtered": _filtered_speed,
    "friction_slope": _slope("friction_slope", "dry_slope"),
    "viscous_slope": _slope("viscous_slope", "viscous_slope"),
    "drive_unequal": _unequal,
    "hardening_spring": _hardening,
    "drive_lag": _slow_current,
    "drive_filter": _filtered_current,
}
