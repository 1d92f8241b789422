"""What a frozen run hides: strata, each with its share of the trials, and what one trial of it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from typing import Any

import hidden_actuator as hidden
import hidden_cases as cases
import numpy as np

from ema.core import config, resources
from ema.core.records import Cycle
from ema.models.actuator import Actuator

EFFECTS = [name for name, case in cases.CASES.items() if case.effects]
OUTSIDE = [name for name, case in cases.CASES.items() if case.outside]
RECORDER = ["recorder_gain", "recorder_offset", "recorder_delay", "current_filter", "clock_skew"]
FAULTS_BESIDE = 2  # at least

Spoil = Callable[[Cycle], Cycle]


@dataclass(frozen=True)
class Trial:
    """One trial: a case with faults, on a bench of one nominal plant, recorded as `record` says."""

    case: str
    values: dict[str, float]
    k: list[float]
    plant: str
    motions: Any
    bench: Any
    n_cycles: int
    record: str

    @property
    def actuator(self) -> Actuator:
        """What the finder is told of the plant."""
        return as_actuator(hidden.PLANTS[self.plant])

    @property
    def told(self) -> dict[str, Any]:
        """What is hidden, for the trial's row."""
        return {
            "case": self.case,
            "plant": self.plant,
            "record": self.record,
            "effects": list(hidden_effects(self.case)),
            "there": list(self.made),
        }

    @property
    def spoil(self) -> Spoil:
        """What a recorder does to a cycle."""
        return RECORDS[self.record]

    @property
    def made(self) -> tuple[str, ...]:
        """Effects of the library that are what the recorder does: one range for all cycles is a converter's."""
        return ("adc_saturation",) if self.record == "clipped" else ()


def as_actuator(n: Any) -> Actuator:
    """The plant file of a nominal plant of the second simulator."""
    plant = config.load(resources.config("actuator.yaml"), Actuator)
    return plant.model_copy(update={
        "motor": plant.motor.model_copy(update={"R": n.R, "L": n.L, "k_e": n.k_e, "p": int(n.p), "J_m": n.J, "C": n.C}),
        "inverter": plant.inverter.model_copy(update={"V_dc": n.V, "h": n.h, "I_max": n.I_max}),
        "transmission": plant.transmission.model_copy(update={"GR": n.GR, "F_s": n.F_s, "F_d": n.F_d, "b": n.b}),
        "control": plant.control.model_copy(update={"K_p": n.K_p, "K_w": n.K_w}),
    })  # fmt: skip


def _short(cycle: Cycle) -> Cycle:
    """The first 0.25 s of each cycle."""
    return Cycle(cycle.number, {name: x[:2501] for name, x in cycle.channels.items()})


def _clipped(cycle: Cycle) -> Cycle:
    """Currents clipped at what the hundredth part of the samples exceeds."""
    currents = ("i_a", "i_b", "i_c")
    top = float(np.quantile(np.abs([cycle[name] for name in currents]), 0.99))
    return Cycle(cycle.number, {n: np.clip(x, -top, top) if n in currents else x for n, x in cycle.channels.items()})


def _gappy(cycle: Cycle) -> Cycle:
    """Ten milliseconds are missing; to be refused, or not to mislead."""
    keep = np.ones(len(cycle["t"]), bool)
    keep[1200:1300] = False
    return Cycle(cycle.number, {name: x[keep] for name, x in cycle.channels.items()})


def _slow(cycle: Cycle) -> Cycle:
    """Every second sample; to be refused, or not to mislead."""
    return Cycle(cycle.number, {name: x[::2] for name, x in cycle.channels.items()})


RECORDS: dict[str, Spoil] = {
    "whole": lambda cycle: cycle, "short": _short, "clipped": _clipped, "gappy": _gappy, "slow": _slow,
}  # fmt: skip


def _case(stratum: str, number: int, seed: int) -> str:
    """The case of a trial; of strata of many cases each has its turn."""
    turn = {"one effect": EFFECTS, "beside faults": EFFECTS, "outside the library": OUTSIDE, "recorder": RECORDER}
    if stratum in turn:
        return turn[stratum][number % len(turn[stratum])]
    if stratum in ("two effects", "three effects"):
        return " + ".join(Random(seed).sample(cases.COMMON, 2 if stratum == "two effects" else 3))
    if stratum == "records":
        return ("none", "faults", *cases.COMMON)[Random(seed).randrange(len(cases.COMMON) + 2)]
    return "none" if stratum == "nothing" else "faults"


# Shares of all trials.
STRATA = {
    "nothing": 0.12, "faults alone": 0.12, "one effect": 0.22, "beside faults": 0.16, "two effects": 0.08,
    "three effects": 0.05, "outside the library": 0.1, "recorder": 0.1, "records": 0.05,
}  # fmt: skip


def hidden_effects(case: str) -> tuple[str, ...]:
    """Effects of the library that a case hides."""
    return cases.case(case).effects


def counts(n: int) -> dict[str, int]:
    """How many trials of each stratum `n` trials are, at least one."""
    return {name: max(1, round(share * n)) for name, share in STRATA.items()}


def drawn(stratum: str, number: int, seed: int) -> Trial:
    """What one trial of a stratum hides."""
    rng = np.random.default_rng(seed)
    name = _case(stratum, number, seed)
    values = cases.case(name).draw(rng)
    k = np.zeros(6)
    if stratum not in ("nothing", "one effect"):
        there = rng.permutation(6)[
            : rng.integers(FAULTS_BESIDE, 7) if stratum == "beside faults" else rng.integers(1, 4)
        ]
        k[there] = rng.uniform(0.01, 0.08, len(there))
    k *= name != "none"
    plant = list(hidden.PLANTS)[int(rng.integers(len(hidden.PLANTS)))]
    nominal = hidden.PLANTS[plant]
    motions, bench = hidden.drawn_motions(rng, nominal.GR), hidden.drawn_bench(rng)._replace(nominal=nominal)
    if {"position_friction", "cushion"} & set(name.split(" + ")):  # must be passed
        bench = bench._replace(position=0.0)
    kinds = [kind for kind in RECORDS if kind != "whole"]
    record = kinds[number % len(kinds)] if stratum == "records" else "whole"
    n_cycles = int(rng.integers(2, 5)) if stratum == "records" else 6
    return Trial(name, values, k.tolist(), plant, motions, bench, n_cycles, record)
