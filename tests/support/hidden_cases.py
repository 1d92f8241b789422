"""What the blind harness hides: a seed draws the size of a flaw, small faults, and noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from random import Random
from typing import Any

import numpy as np

SUPPLY_SEEN = 0.05  # [V] what a recorded bus voltage is good for

Draw = Callable[[np.random.Generator], dict[str, float]]


@dataclass(frozen=True)
class Case:
    """A kind of flaw: how it is drawn, which effects name it, and the library's parameters that must come out."""

    draw: Draw
    effects: tuple[str, ...] = ()
    outside: bool = False
    parameters: dict[str, Callable[[dict[str, float]], float]] = field(default_factory=dict)


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _one(name: str, low: float, high: float, *, signed: bool = False, **fixed: float) -> Draw:
    def draw(rng: np.random.Generator) -> dict[str, float]:
        return {name: float(rng.uniform(low, high)) * (_sign(rng) if signed else 1.0), **fixed}

    return draw


def _several(size: float, *names: str) -> Draw:
    def draw(rng: np.random.Generator) -> dict[str, float]:
        x = rng.standard_normal(len(names))
        x *= size * rng.uniform(0.7, 1.5) / np.abs(x).max()
        return dict(zip(names, x.tolist(), strict=True))

    return draw


def _cogging(rng: np.random.Generator) -> dict[str, float]:
    return {
        "cogging": float(rng.uniform(0.004, 0.015)),
        "cogging_order": float(rng.choice([6, 12, 18, 24, 36])),
        "cogging_phase": float(rng.uniform(-3.0, 3.0)),
    }


def _stribeck(rng: np.random.Generator) -> dict[str, float]:
    return {"stribeck": float(rng.uniform(0.2, 0.6)), "stribeck_speed": float(rng.uniform(8.0, 30.0))}


def _bump(rng: np.random.Generator) -> dict[str, float]:
    centre, width = float(rng.uniform(-0.003, 0.003)), float(rng.uniform(1e-3, 3e-3))
    return {"bump": float(rng.uniform(0.3, 1.0)), "bump_centre": centre, "bump_width": width}


def _both(*draws: Draw) -> Draw:
    def draw(rng: np.random.Generator) -> dict[str, float]:
        return {name: value for one in draws for name, value in one(rng).items()}

    return draw


def _nothing(rng: np.random.Generator) -> dict[str, float]:
    return {}


CASES: dict[str, Case] = {
    "none": Case(_nothing),
    "faults": Case(_nothing),
    "magnet_flux": Case(_one("flux", -0.08, -0.03), ("magnet_flux",),
                        parameters={"magnet_flux.change": lambda f: f["flux"]}),
    "viscous_drag": Case(_one("viscous", 2e-5, 1e-4), ("viscous_drag",),
                         parameters={"viscous_drag.coefficient": lambda f: f["viscous"]}),
    "cogging": Case(_cogging, ("cogging",), parameters={"cogging.order": lambda f: f["cogging_order"],
                                                        "cogging.amplitude": lambda f: f["cogging"]}),
    "current_gain": Case(_several(0.02, "gain_a", "gain_b", "gain_c"), ("current_gain",),
                         parameters={f"current_gain.gain_{j}": lambda f, j=j: f[f"gain_{j}"] for j in "abc"}),
    "current_offset": Case(_several(0.1, "offset_a", "offset_b", "offset_c"), ("current_offset",),
                           parameters={f"current_offset.offset_{j}": lambda f, j=j: f[f"offset_{j}"] for j in "abc"}),
    "position_delay": Case(_one("position_delay", 3e-4, 1.5e-3), ("position_delay",),
                           parameters={"position_delay.time": lambda f: f["position_delay"]}),
    "speed_delay": Case(_one("speed_delay", 3e-4, 1.5e-3), ("speed_delay",),
                        parameters={"speed_delay.time": lambda f: f["speed_delay"]}),
    "stribeck": Case(_stribeck, ("stribeck",)),
    "asymmetric_friction": Case(_one("asymmetry", 0.05, 0.3, signed=True), ("asymmetric_friction",),
                                parameters={"asymmetric_friction.asymmetry": lambda f: f["asymmetry"]}),
    "position_friction": Case(_bump, ("position_friction",)),
    "load_friction": Case(_one("load_friction", 0.5, 3.0), ("load_friction",),
                          parameters={"load_friction.per_torque": lambda f: f["load_friction"]}),
    "quadratic_drag": Case(_one("quadratic", 2e-7, 1e-6), ("quadratic_drag",),
                           parameters={"quadratic_drag.coefficient": lambda f: f["quadratic"]}),
    "constant_load": Case(_one("load", 1.0, 6.0, signed=True), ("constant_load",),
                          parameters={"constant_load.torque": lambda f: f["load"]}),
    "spring_load": Case(_one("spring", 300.0, 2000.0), ("spring_load",),
                        parameters={"spring_load.stiffness": lambda f: f["spring"]}),
    "constant_load on a free user": Case(_one("load", 1.0, 6.0, signed=True, holding=0.5), ("constant_load",),
                                         parameters={"constant_load.torque": lambda f: f["load"]}),
    "spring_load on a free user": Case(_one("spring", 300.0, 2000.0, holding=0.5), ("spring_load",),
                                       parameters={"spring_load.stiffness": lambda f: f["spring"]}),
    "gear_compliance": Case(_one("compliance", 5e-6, 3e-5, user_damping=30.0), ("gear_compliance",),
                            parameters={"gear_compliance.compliance": lambda f: f["compliance"]}),
    "gear_compliance behind a user that rubs": Case(
        _both(
            _one("compliance", 1.5e-5, 4e-5, user_inertia=0.15, user_damping=8.0),
            _one("user_drag", 2.0, 15.0), _one("user_rubbing", 0.3, 2.0),
        ),
        ("gear_compliance",),
        parameters={
            "gear_compliance.compliance": lambda f: f["compliance"],
            "gear_compliance.drag": lambda f: f["user_drag"],
            "gear_compliance.friction": lambda f: f["user_rubbing"],
        },
    ),
    "supply_sag": Case(_one("source_resistance", 0.05, 0.4), ("supply_sag",),
                       parameters={"supply_sag.resistance": lambda f: f["source_resistance"]}),
    "dead_time": Case(_one("dead_time", 1e-6, 3e-6), ("dead_time",),
                      parameters={"dead_time.time": lambda f: f["dead_time"]}),
    "dead_time behind capacitances": Case(
        _both(_one("dead_time", 2e-6, 3.5e-6), _one("soft_current", 0.1, 0.5)), ("dead_time",)),
    "comparator_delay": Case(_one("reaction", 5e-7, 3e-6), ("comparator_delay",),
                             parameters={"comparator_delay.time": lambda f: f["reaction"]}),
    "current_filter": Case(_one("corner", 1200.0, 1700.0), ("current_filter",),
                           parameters={"current_filter.change": lambda f: 2000.0 / f["corner"] - 1.0}),
    "saturation": Case(_one("saturation_current", 20.0, 40.0), ("saturation",)),
    "saturation from the first ampere": Case(_one("first_ampere", 30.0, 80.0), ("saturation",)),
    "commutation_offset": Case(_one("commutation", 0.02, 0.09, signed=True), ("commutation_offset",),
                               parameters={"commutation_offset.angle": lambda f: f["commutation"]}),
    "resolver_error": Case(_several(0.01, "once_cosine", "once_sine", "twice_cosine", "twice_sine"),
                           ("resolver_error",)),
    "resolver_error beside a tachometer": Case(
        _both(_several(0.02, "once_cosine", "once_sine", "twice_cosine", "twice_sine"),
              lambda rng: {"tachometer": 1.0}), ("resolver_error",)),
    "clock_skew": Case(_one("clock_skew", 1e-4, 1e-3, signed=True), ("clock_skew",)),
    "adc_saturation": Case(_one("adc_limit", 4.0, 6.0), ("adc_saturation",),
                           parameters={"adc_saturation.limit": lambda f: f["adc_limit"]}),
    "winding_resistance": Case(_one("resistance", 0.1, 0.4), ("winding_resistance",)),
    "recorder_gain": Case(
        _several(0.04, "recorder_gain_a", "recorder_gain_b", "recorder_gain_c"), ("recorder_gain",),
        parameters={f"recorder_gain.gain_{j}": lambda f, j=j: f[f"recorder_gain_{j}"] for j in "abc"}),
    "recorder_offset": Case(
        _several(0.1, "recorder_offset_a", "recorder_offset_b", "recorder_offset_c"), ("recorder_offset",),
        parameters={f"recorder_offset.offset_{j}": lambda f, j=j: f[f"recorder_offset_{j}"] for j in "abc"}),
    "recorder_delay": Case(_one("recorder_delay", 3e-4, 1.5e-3), ("recorder_delay",),
                           parameters={"recorder_delay.time": lambda f: f["recorder_delay"]}),
    "controller_delay": Case(_one("controller_delay", 3e-4, 1.5e-3), ("controller_delay",),
                             parameters={"controller_delay.time": lambda f: f["controller_delay"]}),
    "torque line 7.37": Case(_one("line", 0.004, 0.015), outside=True),
    "intermittent drag": Case(_one("drag", 0.005, 0.015), outside=True),
    "dead band": Case(_one("deadband", 5e-5, 2e-4), outside=True),
    "slow current loop": Case(_one("slew", 300.0, 1500.0), outside=True),
    "cushion": Case(_one("cushion", 1e5, 4e5), outside=True),
    "hum on phase A": Case(_one("hum", 0.05, 0.2), outside=True),
    "shaker": Case(_one("shaker", 0.004, 0.015), outside=True),
    "weak leg": Case(_one("weak_leg", 0.01, 0.1), outside=True),
    "inertia": Case(_one("inertia", 0.03, 0.3), ("inertia",), parameters={"inertia.change": lambda f: f["inertia"]}),
    "bristles": Case(_one("bristle", 0.02, 0.15), outside=True),
    "integral action": Case(_one("integral", 10.0, 60.0), outside=True),
    "speed loop's gain": Case(_one("speed_gain", -0.3, -0.1), outside=True),
}  # fmt: skip


# Singly not seen in every record: beside another effect their absence from an answer would say nothing.
SELDOM_SEEN = ("clock_skew", "adc_saturation", "saturation", "winding_resistance")
COMMON = [name for name, c in CASES.items() if c.effects == (name,) and name not in SELDOM_SEEN]


PAIRS = ("cogging + viscous_drag", "magnet_flux + current_offset")  # tried with every seed


def together(n: int, seed: int) -> str:
    """Name of a case of `n` effects of the library at once."""
    return " + ".join(Random(10 * seed + n).sample(COMMON, n))


def case(name: str) -> Case:
    """A case of the table, or several of them at once."""
    if name in CASES:
        return CASES[name]
    parts = [CASES[part] for part in name.split(" + ")]
    return Case(
        _both(*(part.draw for part in parts)),
        tuple(effect for part in parts for effect in part.effects),
        parameters={p: truth for part in parts for p, truth in part.parameters.items()},
    )


def kind(name: str) -> str:
    """The row of a table that a case belongs to."""
    return name if name in CASES else f"{len(name.split(' + '))} effects"


def draw(name: str, seed: int) -> tuple[dict[str, float], list[float]]:
    """Values of the flaws and the fault vector of one trial."""
    rng = np.random.default_rng([seed, *name.encode()])
    values = case(name).draw(rng)
    k = rng.uniform(0.0, 0.06, 6) * (rng.random(6) < 0.4)
    if name == "none":
        k[:] = 0.0
    elif name == "faults" and not k.any():
        k[int(rng.integers(6))] = 0.05
    return values, k.tolist()


def draw_bench(hidden: Any, name: str, seed: int) -> tuple[Any, Any]:
    """Motions and bench of one trial; `hidden` is the module hidden_actuator."""
    rng = np.random.default_rng([seed, 1, *name.encode()])
    motions, bench = hidden.drawn_motions(rng), hidden.drawn_bench(rng)
    local = {"position_friction", "cushion"} & set(name.split(" + "))  # must be passed
    return motions, bench._replace(position=0.0) if local else bench


def unseen(name: str, findings: dict[str, Any]) -> list[str]:
    """Parts of a case that the answer does not name; each is there or not whatever stands beside it."""
    told = {effect for e in findings["effects"] for effect in (e["name"], *e["indistinguishable_from"])}
    return [part for part in (name.split(" + ") if name not in CASES else [name]) if not told & {*case(part).effects}]


def visibility(hidden: Any, flaws: Any, part: str, n: int, seed: int, motions: Any, bench: Any) -> float:
    """What one part of a flaw makes of the record over what chance makes of it, in the channel that shows it best."""
    neutral = hidden.Flaws()
    without = flaws._replace(**{x: getattr(neutral, x) for x in case(part).draw(np.random.default_rng(0))})
    flawed, sound, again = (
        hidden.cycles(f, n, s, motions, bench) for f, s in ((flaws, seed), (without, seed), (without, seed + 500_000))
    )
    smooth = np.ones(50) / 50.0

    def differ(a: list[Any], b: list[Any], channel: Callable[[Any], np.ndarray]) -> float:
        pairs = zip(a, b, strict=True)
        return float(np.mean([np.mean(np.convolve(channel(x) - channel(y), smooth, "valid") ** 2) for x, y in pairs]))

    channels: list[tuple[Callable[[Any], np.ndarray], float]] = [
        (lambda c: c["theta_u"], 0.0),
        (lambda c: c["theta_m"], 0.0),
        (lambda c: np.max(np.abs([c["i_a"], c["i_b"], c["i_c"]]), axis=0), 0.0),
        *((lambda c, name=name: np.abs(c[name]), 0.0) for name in ("i_a", "i_b", "i_c")),
        (lambda c: c["u_dc"], SUPPLY_SEEN),
    ]
    return float(np.sqrt(max(differ(flawed, sound, x) / (differ(again, sound, x) + floor**2) for x, floor in channels)))


def outcome(name: str, findings: dict[str, Any], made: tuple[str, ...] = ()) -> str:
    """How the finder did: right, in set, wrong, missed. What the recorder `made` besides may be named, or not."""
    of = case(name)
    effects = [e for e in findings["effects"] if e["name"] in of.effects or e["name"] not in made]
    sets = [{e["name"], *e["indistinguishable_from"]} for e in effects]
    named = [e["name"] for e in effects]
    verdict = findings["verdict"]
    if of.outside:
        return "missed" if verdict == "adequate" else "right" if verdict == "unexplained" and not named else "wrong"
    if not of.effects:
        only_made = bool(findings["effects"]) and not named
        return "right" if verdict == "adequate" or only_made else "wrong"
    if sorted(named) == sorted(of.effects) and all(len(s) == 1 for s in sets):
        return "right"
    if named and all(s & set(of.effects) for s in sets):
        return "in set" if all(any(t in s for s in sets) for t in of.effects) else "missed"
    return "wrong" if named else "missed"
