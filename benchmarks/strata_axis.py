"""What a frozen run of the axis hides: strata, each with its share of the trials, and what one trial of it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from random import Random
from typing import Any

import axis_bench
import axis_other
import hidden_axis
import numpy as np
import positioner
import servo

from ema.core.records import Array, Cycle, Record

EFFECTS = list(hidden_axis.LIBRARY)
OUTSIDE = list(hidden_axis.OUTSIDE)
# Torque, inertia beyond that, inductance and resistance over those of tests/support/axis_bench.py.
PLANTS = {"small": (1.0, 1.0, 1.0, 1.0), "strong": (5.0, 2.5, 3.0, 1.5), "tiny": (0.25, 0.5, 0.4, 2.0)}
TORQUE = {("viscous_drag", "coefficient"), ("quadratic_drag", "coefficient"), ("cogging", "amplitude"),
          ("constant_load", "torque"), ("spring_load", "stiffness"), ("inverter_drop", "voltage"),
          ("supply_sag", "resistance")}  # fmt: skip
# Parameters whose law the simulator shares with the library: of others no true value exists.
EXACT = {"cogging.amplitude", "asymmetric_friction.asymmetry", "constant_load.torque", "magnet_flux.change",
         "winding_resistance.change", "inverter_drop.voltage", "speed_delay.time", "position_delay.time",
         "clock_skew.rate", "inertia.change", "drive_gain.gain", "drive_offset.offset",
         "viscous_by_direction.difference"}  # fmt: skip


@dataclass(frozen=True)
class Trial:
    """One record with its plant file; `effects` are those hidden, of the library's, and `truth` their exact values."""

    case: str
    plant: str
    plant_file: dict[str, Any]
    record: Record
    effects: tuple[str, ...]
    truth: dict[str, float]


def _bench(names: list[str], seed: int, plant: str) -> Trial:
    """A bench of `tests/support/axis_bench.py`, of another size, with effects in it."""
    torque, heavier, inductive, resistive = PLANTS[plant]
    bench, plant_file, motions = hidden_axis.drawn(seed)
    bench.J *= torque * heavier
    for name in ("C", "F_d", "F_s", "k_t", "k_e", "V_dc"):
        setattr(bench, name, getattr(bench, name) * torque)
    bench.R, bench.L = bench.R * resistive, bench.L * inductive
    noise = {**bench.noise, "u_q": bench.noise["u_q"] * max(torque, 1.0)}
    bench.noise = noise
    told = {name: getattr(bench, name) for name in ("J", "C", "k_t", "k_e", "R", "L", "V_dc")}
    told |= {name: torque * plant_file[name] for name in ("F_d", "F_s")}
    told |= {"noise": dict(noise)} if "noise" in plant_file else {}
    bench, drawn, rng = hidden_axis.bench_with(names, seed, bench)
    opposing, voltage = bench.torque, bench.voltage
    bench.torque = lambda *at: torque * opposing(*at)
    bench.voltage = lambda u, i: torque * voltage(u / torque, i)
    truth = {
        f"{e}.{p}": float(x) * (torque if (e, p) in TORQUE else 1.0) for e, own in drawn.items() for p, x in own.items()
    }
    record = axis_bench.record(bench, rng, motions=motions)
    library = tuple(name for name in names if name in hidden_axis.LIBRARY)
    return Trial("+".join(names) or "nothing", plant, {**plant_file, **told}, record, library, truth)


def _nothing(number: int, seed: int, plant: str) -> Trial:
    return _bench([], seed, plant)


def _one(number: int, seed: int, plant: str) -> Trial:
    return _bench([EFFECTS[number % len(EFFECTS)]], seed, plant)


def _two(number: int, seed: int, plant: str) -> Trial:
    return _bench(Random(seed).sample(EFFECTS, 2), seed, plant)


def _outside(number: int, seed: int, plant: str) -> Trial:
    return _bench([OUTSIDE[number % len(OUTSIDE)]], seed, plant)


def _spoiled(number: int, seed: int, plant: str) -> Trial:
    """What a recorder does to a record of nothing, or of one effect."""
    how = list(SPOIL)[number % len(SPOIL)]
    names = [EFFECTS[Random(seed).randrange(len(EFFECTS))]] if number // len(SPOIL) % 2 else []
    t = _bench(names, seed, plant)
    record = Record(tuple(SPOIL[how](c) for c in t.record))
    return replace(
        t, case=f"{t.case}, {how}", record=record, plant_file={k: v for k, v in t.plant_file.items() if k != "noise"}
    )


def _each(change: Callable[[str, Array], Array]) -> Callable[[Cycle], Cycle]:
    return lambda c: Cycle(c.number, {name: change(name, x) for name, x in c.channels.items()})


SPOIL: dict[str, Callable[[Cycle], Cycle]] = {
    "coarse": _each(lambda name, x: np.round(x, {"theta_m": 3, "w_m": 1, "i_q": 2, "u_q": 1}.get(name, 9))),
    "clipped": _each(lambda name, x: np.clip(x, *np.quantile(x, [0.01, 0.99])) if name == "i_q" else x),
    "gappy": _each(lambda name, x: np.delete(x, np.s_[600:640])),
    "slow": _each(lambda name, x: x[::4]),
}


def _other(number: int, seed: int, plant: str) -> Trial:
    """Axes of another simulator (bristles, encoders, masses), with one of its effects or none."""
    name = list(axis_other.SETUPS)[number % len(axis_other.SETUPS)]
    rng = np.random.default_rng(seed)
    hidden = [0.0] * 8
    setup = axis_other.SETUPS[name]
    choice = int(rng.integers(3))
    effects, truth = [], {}
    if choice == 1:
        hidden[axis_other.VISCOUS] = float(rng.uniform(0.5, 2.0)) * setup.F_d / max(m[0] for m in setup.motions)
        effects = ["viscous_drag"]
    if choice == 2:
        hidden[axis_other.ASYMMETRY] = float(rng.uniform(0.1, 0.3))
        effects, truth = ["asymmetric_friction"], {"asymmetric_friction.asymmetry": hidden[axis_other.ASYMMETRY]}
    record = axis_other.record(replace(setup, hidden=tuple(hidden)), seed % 100_000)
    case = "+".join(effects) or "nothing"
    return Trial(f"{case}, {name}", name, dict(axis_other.plant(setup)), record, tuple(effects), truth)


def _loops(number: int, seed: int, plant: str) -> Trial:
    """Speed and position loops: a servo's, a positioning table's cascade, a geared servo with a pendulum."""
    rng = np.random.default_rng(seed)
    s = seed % 100_000
    kind = ("speed loop", "cascade", "pendulum")[number % 3]
    if kind == "speed loop":
        change = float(rng.uniform(0.05, 0.3)) * (number // 3 % 2)
        record = servo.record(s, samples=bool(rng.integers(2)), inertia=0.0085 * (1.0 + change))
        return _loop(kind, servo.SPEED_LOOP, record, {"inertia.change": change})
    if kind == "cascade":
        table = positioner.Table(M=float(rng.uniform(40.0, 120.0)), F_d=float(rng.uniform(12.0, 25.0)))
        d = float(rng.uniform(15.0, 40.0)) * (number // 3 % 2)
        table = replace(table, C_positive=200.0 + d, C_negative=200.0 - d)
        return _loop(
            kind, positioner.table_plant(table), positioner.table(table, s), {"viscous_by_direction.difference": d}
        )
    bench = positioner.Servo(by_load=float(rng.uniform(0.1, 0.3)) * (number // 3 % 2))
    record = positioner.servo(bench, s)
    found = {"pendulum.amplitude": bench.gravity, "output_load_friction.share": bench.by_load}
    return _loop(kind, positioner.servo_plant(bench), record, found)


def _loop(kind: str, plant_file: dict[str, Any], record: Record, values: dict[str, float]) -> Trial:
    there = {name: x for name, x in values.items() if x}
    effects = tuple(dict.fromkeys(name.split(".")[0] for name in there))
    return Trial(f"{'+'.join(effects) or 'nothing'}, {kind}", kind, plant_file, record, effects, there)


# Shares of all trials, and what makes one.
STRATA: dict[str, tuple[float, Callable[[int, int, str], Trial]]] = {
    "nothing": (0.25, _nothing), "one effect": (0.33, _one), "two effects": (0.1, _two),
    "outside the library": (0.1, _outside), "recorder": (0.06, _spoiled), "other makers": (0.08, _other),
    "loops": (0.08, _loops),
}  # fmt: skip


def counts(n: int) -> dict[str, int]:
    """How many trials of each stratum `n` trials are, at least one."""
    return {name: max(1, round(share * n)) for name, (share, _) in STRATA.items()}


def drawn(stratum: str, number: int, seed: int) -> Trial:
    """One trial; which plant follows from the seed."""
    return STRATA[stratum][1](number, seed, list(PLANTS)[seed % len(PLANTS)])
