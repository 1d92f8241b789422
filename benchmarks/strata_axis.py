"""What a frozen run of the axis hides: strata, each with its share of the trials, and what one trial of it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from random import Random
from typing import Any

import axis_bench
import axis_other
import belt_bench
import geared
import hidden_axis
import numpy as np
import positioner
import servo
import strange

from benchmarks import strata_laws
from ema.core.records import Array, Cycle, Record

EFFECTS = list(hidden_axis.LIBRARY)
# Of other simulators, what the library has got a law for since.
LEARNT = {"one_sided_driver": "drive_unequal", "current_ripple": "flux_ripple", "crank": "inertia_by_angle",
          "friction_twice": "friction_by_angle", "gap": "gear_play"}  # fmt: skip
OUTSIDE = [kind for kind in (*hidden_axis.OUTSIDE, *strange.KINDS) if kind not in ("nothing", "current_lag", *LEARNT)]
# Effects of the library that act like what is outside it, so that naming them is the right place.
NEAR = {
    "cushion": ("spring_load",), "maxwell_slip": ("friction_memory",),
    "heat": ("friction_drift",), "clutch": ("gear_compliance",),
    "one_way_fan": ("quadratic_drag", "viscous_by_direction"), "load_step": ("constant_load",),
    "centrifugal": ("quadratic_drag", "viscous_drag"),
}  # fmt: skip
# What is hidden as the second is the first too, where the motion shows it: that spring stiffens with its square.
ALSO = {"stiffening_spring": "spring_load"}
# Torque, inertia beyond that, inductance and resistance over those of tests/support/axis_bench.py.
PLANTS = {"small": (1.0, 1.0, 1.0, 1.0), "strong": (5.0, 2.5, 3.0, 1.5), "tiny": (0.25, 0.5, 0.4, 2.0)}
TORQUE = {("viscous_drag", "coefficient"), ("quadratic_drag", "coefficient"), ("cogging", "amplitude"),
          ("constant_load", "torque"), ("spring_load", "stiffness"), ("inverter_drop", "voltage"),
          ("supply_sag", "resistance")}  # fmt: skip
# Parameters whose law the simulator shares with the library: of others no true value exists.
EXACT = {"cogging.amplitude", "asymmetric_friction.asymmetry", "constant_load.torque", "magnet_flux.change",
         "winding_resistance.change", "inverter_drop.voltage", "speed_delay.time", "position_delay.time",
         "clock_skew.rate", "inertia.change", "drive_gain.gain", "drive_offset.offset",
         "viscous_by_direction.difference", "output_load_friction.share", "pendulum.amplitude",
         "quadratic_load_friction.per_square", "quadratic_output_load_friction.per_torque", "friction_drift.rate",
         "viscous_drift.rate", "gear_error.amplitude", "external_torque.amplitude", "drive_lag.time",
         "drive_compliance.compliance"}  # fmt: skip


@dataclass(frozen=True)
class Trial:
    """Records with their plant file; `effects` are those hidden, of the library's, and `truth` their exact values.

    `near`: effects of the library that act like what is hidden and is none of them. `there`: what the bench has of its
    own besides, seen or not, and what may be named. `without` makes the records again without noise and without one of
    the effects, or with all (""); `noise` is each channel's rms.
    """

    case: str
    plant: str
    plant_file: dict[str, Any]
    records: tuple[Record, ...]
    effects: tuple[str, ...]
    truth: dict[str, float]
    near: tuple[str, ...] = ()
    without: Callable[[str], Record] | None = None
    noise: Mapping[str, float] = field(default_factory=dict)
    there: tuple[str, ...] = ()

    @property
    def told(self) -> dict[str, Any]:
        """What is hidden, for the trial's row."""
        hidden = {
            "effects": list(self.effects),
            "near": list(self.near),
            "there": list(self.there),
            "hidden": self.truth,
        }
        return {"case": self.case, "plant": self.plant, **hidden}

    @property
    def kind(self) -> str:
        """Its name without the bench."""
        return self.case.split(",")[0]


def nats(t: Trial, name: str) -> float:
    """How much likelier records are with one effect than without it, all else known: more no finder can see of it.

    Where nothing says how the records were made, each effect counts as seen.
    """
    if t.without is None:
        return 1e9
    total = 0.0
    for c, other in zip(t.without("").cycles, t.without(name).cycles, strict=True):
        for channel, rms in t.noise.items():
            late = (c["t"] - other["t"]) * np.gradient(c[channel], c["t"])  # a clock that is off shows as that
            total += 0.5 * float(np.sum(((c[channel] - other[channel] - late) / rms) ** 2))
    return total


def _bench(names: list[str], seed: int, plant: str) -> Trial:
    """A bench of `tests/support/axis_bench.py`, of another size, with effects in it."""
    bench, rng, motions, file, truth = _sized(names, seed, plant)
    record = axis_bench.record(bench, rng, motions=motions)

    def without(name: str) -> Record:
        bare, own, *_ = _sized(names, seed, plant, name)
        bare.noise = dict.fromkeys(bare.noise, 0.0)
        return axis_bench.record(bare, own, motions=motions)

    library = tuple(name for name in names if name in hidden_axis.LIBRARY)
    case = "+".join(names) or "nothing"
    near = (*NEAR.get(case, ()), *(also for also, name in ALSO.items() if name in names))
    return Trial(case, plant, file, (record,), library, truth, near, without, dict(bench.noise))


def _sized(names: list[str], seed: int, plant: str, but: str = "") -> tuple[Any, Any, Array, dict[str, Any], Any]:
    """Bench, its random numbers, motions, plant file and truth; the effect `but` is drawn and not hidden."""
    torque, heavier, inductive, resistive = PLANTS[plant]
    bench, plant_file, motions = hidden_axis.drawn(seed)
    bench.J *= torque * heavier
    for name in ("C", "F_d", "F_s", "k_t", "k_e"):
        setattr(bench, name, getattr(bench, name) * torque)
    bench.R, bench.L = bench.R * resistive, bench.L * inductive
    noise = {**bench.noise, "u_q": bench.noise["u_q"] * max(torque, 1.0)}
    bench.noise = noise
    told = {name: getattr(bench, name) for name in ("J", "C", "k_t", "k_e", "R", "L")}
    told["V_dc"] = torque * bench.V_dc  # what is hidden in the voltage is drawn at the bench's own, and scaled below
    told |= {name: torque * plant_file[name] for name in ("F_d", "F_s")}
    told |= {"noise": dict(noise)} if "noise" in plant_file else {}
    bench, drawn, rng = hidden_axis.bench_with(names, seed, bench, but)
    opposing, voltage = bench.torque, bench.voltage
    bench.torque = lambda *at: torque * opposing(*at)
    bench.voltage = lambda u, i: torque * voltage(u / torque, i)
    truth = {
        f"{e}.{p}": float(x) * (torque if (e, p) in TORQUE else 1.0) for e, own in drawn.items() for p, x in own.items()
    }
    return bench, rng, motions, {**plant_file, **told}, truth


def _nothing(number: int, seed: int, plant: str) -> Trial:
    return _bench([], seed, plant)


def _one(number: int, seed: int, plant: str) -> Trial:
    return _bench([EFFECTS[number % len(EFFECTS)]], seed, plant)


def _two(number: int, seed: int, plant: str) -> Trial:
    return _bench(Random(seed).sample(EFFECTS, 2), seed, plant)


def _three(number: int, seed: int, plant: str) -> Trial:
    return _bench(Random(seed).sample(EFFECTS, 3), seed, plant)


def _outside(number: int, seed: int, plant: str) -> Trial:
    return of_kind(OUTSIDE[number % len(OUTSIDE)], seed, plant)


def of_kind(kind: str, seed: int, plant: str) -> Trial:
    """A law of another simulator; of what the library has learnt, the effect is hidden."""
    made = _of_other_simulator(kind, seed, plant)
    return replace(made, effects=(LEARNT[kind],)) if kind in LEARNT else made


def _of_other_simulator(kind: str, seed: int, plant: str) -> Trial:
    if kind in hidden_axis.OUTSIDE:
        return _bench([kind], seed, plant)
    torque, heavier, *_ = PLANTS[plant]
    d = strange.Axis()
    axis = replace(d, J=d.J * torque * heavier, F=d.F * torque, C=d.C * torque, k_t=d.k_t * torque)
    record = strange.record(kind, axis, seed % 100_000, stiff=heavier)
    return Trial(kind, plant, strange.plant(axis), (record,), (), {}, NEAR.get(kind, ()))


def _law(number: int, seed: int, plant: str) -> Trial:
    """A law of a warm, geared, compliant axis, or none, under cascaded loops; or one of those learnt."""
    kinds = [*strata_laws.HIDDEN, *LEARNT, "nothing"]
    name = kinds[number % len(kinds)]
    if name in LEARNT:
        return of_kind(name, seed, plant)
    rng = np.random.default_rng(seed)
    torque, heavier, *_ = PLANTS[plant]
    d = geared.Axis()
    axis = replace(
        d, J=d.J * torque * heavier * rng.uniform(0.7, 1.4), F=d.F * torque * rng.uniform(0.7, 1.4), C=d.C * torque,
        k_t=d.k_t * torque,
    )  # fmt: skip
    h = strata_laws.Hidden(axis) if name == "nothing" else strata_laws.hidden(name, axis, rng)
    size, loop = rng.uniform(0.7, 1.4), (40.0, 0.05 * heavier)
    records = tuple(
        h.spoil(geared.record(a, seed % 100_000 + k, seconds=8.0, size=size, temperature=h.is_warm, loop=loop))
        for k, a in enumerate((h.axis, *h.others))
    )
    told = {k: v for k, v in {**geared.plant(h.axis), **h.plant_file}.items() if v is not None}
    return Trial(f"{name}, cascade", plant, told, records, h.effects, dict(h.truth))


def _spoiled(number: int, seed: int, plant: str) -> Trial:
    """What a recorder does to a record of nothing, or of one effect."""
    how = list(SPOIL)[number % len(SPOIL)]
    names = [EFFECTS[Random(seed).randrange(len(EFFECTS))]] if number // len(SPOIL) % 2 else []
    t = _bench(names, seed, plant)
    record = Record(tuple(SPOIL[how](c) for c in t.records[0].cycles[: 2 if how == "short" else None]))
    return replace(
        t, case=f"{t.case}, {how}", records=(record,),
        plant_file={k: v for k, v in t.plant_file.items() if k != "noise"},
    )  # fmt: skip


def _each(change: Callable[[str, Array], Array]) -> Callable[[Cycle], Cycle]:
    return lambda c: Cycle(c.number, {name: change(name, x) for name, x in c.channels.items()})


def _jittery(c: Cycle) -> Cycle:
    """Stamped by a clock that counts in steps of a third of a sample."""
    step = c.period / 3.0
    late = np.random.default_rng(c.n_samples).uniform(0.0, 0.6, c.n_samples) * c.period
    return Cycle(c.number, {**c.channels, "t": np.floor((c["t"] + late) / step) * step})


SPOIL: dict[str, Callable[[Cycle], Cycle]] = {
    "coarse": _each(lambda name, x: np.round(x, {"theta_m": 3, "w_m": 1, "i_q": 2, "u_q": 1}.get(name, 9))),
    "clipped": _each(lambda name, x: np.clip(x, *np.quantile(x, [0.01, 0.99])) if name == "i_q" else x),
    "gappy": _each(lambda name, x: np.delete(x, np.s_[600:640])),
    "slow": _each(lambda name, x: x[::4]),
    "short": _each(lambda name, x: x[: len(x) // 2]),
    "repeating": _each(lambda name, x: x if name == "t" else np.where(np.arange(len(x)) % 97 == 5, np.roll(x, 1), x)),
    "jittery": _jittery,
}


def _other(number: int, seed: int, plant: str) -> Trial:
    """Axes of another simulator (bristles, encoders, masses), with one of its effects or none; bristles are there."""
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
    file, there = dict(axis_other.plant(setup)), ("friction_memory",)
    return Trial(f"{case}, {name}", name, file, (record,), tuple(effects), truth, there=there)


def _loops(number: int, seed: int, plant: str) -> Trial:
    """Speed and position loops: a servo's, a table's cascade, a geared servo with a pendulum, a belt seen behind it."""
    rng = np.random.default_rng(seed)
    s = seed % 100_000
    kind = ("speed loop", "cascade", "pendulum", "belt")[number % 4]
    if kind == "speed loop":
        change = float(rng.uniform(0.05, 0.3)) * (number // 4 % 2)
        record = servo.record(s, samples=bool(rng.integers(2)), inertia=0.0085 * (1.0 + change))
        return _loop(kind, servo.SPEED_LOOP, record, {"inertia.change": change})
    if kind == "cascade":
        return _cascade(number // 4, s, rng)
    if kind == "belt":
        return _belt(number // 4 % 2 == 0, s, rng)
    bench = positioner.Servo(by_load=float(rng.uniform(0.1, 0.3)) * (number // 4 % 2))
    record = positioner.servo(bench, s)
    found = {"pendulum.amplitude": bench.gravity, "output_load_friction.share": bench.by_load}
    return _loop(kind, positioner.servo_plant(bench), record, found)


def _belt(gives: bool, s: int, rng: np.random.Generator) -> Trial:
    """A pulley whose angle is recorded, behind a belt that gives or is stiffer than the record shows."""
    b, frequency = belt_bench, float(rng.uniform(15.0, 35.0)) if gives else 400.0
    record = b.record(float(rng.uniform(0.0, b.F_L)), at_load=True, frequency=frequency, seed=s)
    plant_file = {"kind": "axis", "J": b.J_M + b.J_L, "F_d": b.F_M + b.F_L, "C": b.C, "k_t": b.K_T}
    compliance = (b.FREQUENCY / frequency) ** 2 / b.STIFFNESS if gives else 0.0
    found = {"drive_compliance.compliance": compliance}
    return _loop("belt", {**plant_file, "measured_at": "load"}, record, found)


def _cascade(number: int, s: int, rng: np.random.Generator) -> Trial:
    """A positioning table, of three masses a factor of two apart."""
    mass = float(rng.choice([30.0, 70.0, 160.0]))
    table = positioner.Table(M=mass * float(rng.uniform(0.8, 1.25)), F_d=float(rng.uniform(12.0, 25.0)))
    d, load, k = float(rng.uniform(15.0, 40.0)), float(rng.uniform(3.0, 8.0)), float(rng.uniform(60.0, 200.0))
    kinds: list[tuple[dict[str, float], dict[str, float]]] = [
        ({}, {}),
        ({"C_positive": 200.0 + d, "C_negative": 200.0 - d}, {"viscous_by_direction.difference": d}),
        ({"constant": load}, {"constant_load.torque": load}),
        ({"spring": k}, {"spring_load.stiffness": k}),
        ({"quadratic": 5.0 * d}, {"quadratic_drag.coefficient": 5.0 * d}),
    ]
    change, there = kinds[number % len(kinds)]
    table = replace(table, **change)
    return _loop("cascade", positioner.table_plant(table), positioner.table(table, s), there)


def _loop(kind: str, plant_file: dict[str, Any], record: Record, values: dict[str, float]) -> Trial:
    there = {name: x for name, x in values.items() if x}
    effects = tuple(dict.fromkeys(name.split(".")[0] for name in there))
    return Trial(f"{'+'.join(effects) or 'nothing'}, {kind}", kind, plant_file, (record,), effects, there)


# Shares of all trials, and what makes one.
STRATA: dict[str, tuple[float, Callable[[int, int, str], Trial]]] = {
    "nothing": (0.13, _nothing), "one effect": (0.22, _one), "law, cascaded loops": (0.22, _law),
    "two effects": (0.1, _two), "three effects": (0.05, _three), "outside the library": (0.08, _outside),
    "recorder": (0.07, _spoiled), "other makers": (0.07, _other), "loops": (0.07, _loops),
}  # fmt: skip


def counts(n: int) -> dict[str, int]:
    """How many trials of each stratum `n` trials are, at least one."""
    return {name: max(1, round(share * n)) for name, (share, _) in STRATA.items()}


def drawn(stratum: str, number: int, seed: int) -> Trial:
    """One trial; which plant follows from the seed."""
    return STRATA[stratum][1](number, seed, list(PLANTS)[seed % len(PLANTS)])
