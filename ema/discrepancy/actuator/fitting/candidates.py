"""Every effect of the library as something to try on a three-phase actuator: probes for a first look, and what to fit.

A *probe* is a point with the effect switched on by a known amount; differences of probes from the nominal simulation
are the columns with which all candidates are screened at once, linearly. Only the best few are then fitted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ema.core.names import FAULTS
from ema.core.records import Array
from ema.discrepancy.actuator.reading.gear import Resonance
from ema.discrepancy.actuator.reading.measured import Measured
from ema.discrepancy.actuator.reading.weak import Torque, bumps, lines
from ema.discrepancy.plant import Point
from ema.effects import registry
from ema.models.actuator import Actuator

from .free import Free, free

FLAT, FLAT_SAMPLES = 5e-3, 10  # [A] samples of one cycle at the largest current that make a clipped top
CLIPPED_STEP = 0.05  # [A] of the finite difference of a converter's limit
HARDLY_FILTERED = -0.97  # relative change of time constants
SIZES = (0.5, 1.0, 2.0, 4.0)  # times the step of a probe: usual sizes of an effect
ZERO_KNOWN = 3e-7  # [rad at the user] to which a record tells how far the zeros of its sensors lie apart
WARMER = 3.0  # [K] spread of winding temperature below which nothing can be said about temperature

Way = tuple[str, tuple[str, ...]]  # an effect, and the parameters by which it acts


@dataclass(frozen=True)
class Candidate:
    """One effect with its nonlinear parameters near some value.

    Attributes
    ----------
    effect : str
    frees : tuple of Free
        Parameters to fit.
    fixed : Mapping
        Values of parameters in the probes: those that are not linear.
    linear : tuple of str
        Parameters that the effect is (nearly) proportional to; one probe each.
    shown : tuple of float
        Their values, less neutral, as the residual torque or the sensors' zeros themselves show them; else none.
    beside : tuple of Candidate
        Other effects that the record shows together with it: without these no fit of it gets near.
    """

    effect: str
    frees: tuple[Free, ...]
    fixed: Mapping[str, float]
    linear: tuple[str, ...]
    steps: tuple[float, ...]
    shown: tuple[float, ...] = ()
    beside: tuple[Candidate, ...] = ()

    @property
    def faults(self) -> list[str]:
        """Faults that the effect can be mistaken for."""
        return [name for name in registry()[self.effect].mistaken_for if name in FAULTS]

    @property
    def is_seen(self) -> bool:
        """Whether the effect is plain to see in the record."""
        return False

    @property
    def way(self) -> Way:
        """How the effect acts: a clock that is off may be the recorder's own or the controller's too."""
        return self.effect, self.linear

    @property
    def key(self) -> str:
        """Distinct for candidates with other probes."""
        of = f"{self.effect} {' '.join(self.linear)}"
        return of + "".join(f" {name}={value:.4g}" for name, value in sorted(self.fixed.items()))

    def probe_name(self, j: int) -> str:
        """Name of the column of a probe, which ends with that of the parameter."""
        return f"{self.key}/{j}.{self.linear[j % len(self.linear)]}"

    @property
    def amounts(self) -> Array:
        """By how much each probe differs from neutral."""
        neutral = registry()[self.effect].neutral()
        return np.array([s - neutral[name] for name, s in zip(self.linear, self.steps, strict=True)])

    def probes(self) -> list[Point]:
        """One point for each column."""
        return [
            {**{f"{self.effect}.{n}": v for n, v in self.fixed.items()}, f"{self.effect}.{name}": step}
            for name, step in zip(self.linear, self.steps, strict=True)
        ]

    def wider(self, factor: float) -> Candidate:
        """The same with longer steps, inside bounds."""
        frees = [replace(f, step=factor * f.step) if f.name.split(".")[1] in self.linear else f for f in self.frees]
        return replace(self._with_amounts(np.clip(factor * self.amounts, *self.limits())), frees=tuple(frees))

    def sized(self, values: Array) -> Candidate:
        """The same with steps as long, on average, as values of the linear parameters (less neutral).

        To the side of the values, where bounds leave any of it.
        """
        usual = np.sqrt(np.mean((values / self.amounts) ** 2)) * self.amounts
        there, back = (np.clip(x, *self.limits()) for x in (np.copysign(usual, values), usual))
        return self._with_amounts(np.where(there == 0.0, back, there))

    def _with_amounts(self, amounts: Array) -> Candidate:
        neutral = np.array(self.steps) - self.amounts
        return replace(self, steps=tuple((neutral + amounts).tolist()))

    def limits(self) -> tuple[Array, Array]:
        """Bounds of the linear parameters, less neutral."""
        parameters = {p.name: p for p in registry()[self.effect].parameters}
        chosen = [parameters[name] for name in self.linear]
        return np.array([p.low - p.neutral for p in chosen]), np.array([p.high - p.neutral for p in chosen])

    def start(self, values: Array) -> Point:
        """The point to begin a fit from, given the linear parameters' values (less neutral)."""
        neutral = registry()[self.effect].neutral()
        point = {f"{self.effect}.{name}": value for name, value in self.fixed.items()}
        for name, value in zip(self.linear, values, strict=True):
            point[f"{self.effect}.{name}"] = neutral[name] + value
        return {f.name: float(np.clip(point[f.name], f.low, f.high)) for f in self.frees} | {
            name: value for name, value in point.items() if name not in {f.name for f in self.frees}
        }

    def shown_starts(self) -> list[Point]:
        """The start that the record itself shows, where it shows one."""
        return [self.start(np.clip(self.shown, *self.limits()))] if self.shown else []

    def sizes(self) -> list[Point]:
        """Starts of the sizes that are usual, where one parameter tells the size."""
        if len(self.linear) > 1:
            return []
        values = np.outer((-1.0, 1.0), np.array(SIZES) * self.amounts[0]).ravel()
        low, high = self.limits()
        return [self.start(np.array([x])) for x in values if low[0] <= x <= high[0]]


@dataclass(frozen=True)
class Seen(Candidate):
    """An effect that is plain to see in the record: a fit begins with what is seen there."""

    faults_seen: Point = field(default_factory=dict)

    @property
    def is_seen(self) -> bool:
        """It is."""
        return True

    def start(self, values: Array) -> Point:
        """The probe, and faults that are seen beside it."""
        return {**self.probes()[0], **self.faults_seen}

    def sizes(self) -> list[Point]:
        """None but what is seen."""
        return []


@dataclass(frozen=True)
class Line(Candidate):
    """A torque line: linear in A cos φ and A sin φ."""

    @property
    def amounts(self) -> Array:
        """Amplitude of both probes."""
        return np.repeat(np.array(self.steps), 2)

    def wider(self, factor: float) -> Candidate:
        """The same with a larger amplitude."""
        return replace(self, steps=tuple(factor * x for x in self.steps))

    def sized(self, values: Array) -> Candidate:
        """The same with the amplitude that A cos φ and A sin φ have on average, inside bounds."""
        return replace(self, steps=(min(float(np.sqrt(np.mean(values**2))), float(self.limits()[1][0])),))

    def probes(self) -> list[Point]:
        """Sine and cosine of the line."""
        on = {f"{self.effect}.{n}": v for n, v in self.fixed.items()} | {f"{self.effect}.amplitude": self.steps[0]}
        return [{**on, f"{self.effect}.phase": 0.0}, {**on, f"{self.effect}.phase": 0.5 * np.pi}]

    def sizes(self) -> list[Point]:
        """None: a line begins with its phase."""
        return []

    def limits(self) -> tuple[Array, Array]:
        """Of A cos φ and A sin φ."""
        high = next(p.high for p in registry()[self.effect].parameters if p.name == "amplitude")
        return np.full(2, -high), np.full(2, high)

    def start(self, values: Array) -> Point:
        """Amplitude and phase from A cos φ and A sin φ."""
        found = {
            "amplitude": float(np.hypot(values[0], values[1])),
            "phase": float(np.arctan2(values[1], values[0])),
            **self.fixed,
        }
        return {f"{self.effect}.{name}": value for name, value in found.items()}


@dataclass(frozen=True)
class Commutation(Candidate):
    """A commutation that is off. The torque dips alike to either side, so its sign is taken from sensors that agree.

    Attributes
    ----------
    recorded : float
        What the recorded rotor angle is off by if the user's sensor is right. [rad electrical]
    """

    recorded: float = 0.0

    @property
    def key(self) -> str:
        """Distinct for zeros that lie otherwise apart: what the recorded angle is off by is taken for the user's."""
        return f"{super().key} {self.recorded:.4g}"

    @property
    def is_seen(self) -> bool:
        """Whether the zeros show it: then it is off by that, or it is the user's zero, which only a fit tells."""
        return bool(self.shown)

    def start(self, values: Array) -> Point:
        """What the currents commutate against the recorded angle, and what that angle is off by."""
        apart = values[self.linear.index("apart")]
        return Candidate.start(self, np.array([apart + self.recorded, apart]))


def _plain(effect: str, *names: str, step: Mapping[str, float] | None = None, **fixed: float) -> Candidate:
    """Linear in `names`; `fixed` are fitted too, from the given values."""
    parameters = {p.name: p for p in registry()[effect].parameters}
    step = step or {}
    steps = tuple(step.get(n, parameters[n].start - parameters[n].neutral) for n in names)
    frees = [free(f"{effect}.{n}", s) for n, s in zip(names, steps, strict=True)]
    frees += [free(f"{effect}.{n}", step.get(n, 0.15 * value)) for n, value in fixed.items()]
    at = tuple(parameters[n].neutral + s for n, s in zip(names, steps, strict=True))
    return Candidate(effect, tuple(frees), fixed, names, at)


def _electrical(plant: Actuator, zero: float) -> float:
    """An angle at the user as electrical angle. [rad]"""
    return plant.motor.p * plant.transmission.GR * zero


def resolver_zero(plant: Actuator, zero: float, known: float) -> Candidate:
    """A commutation that is off by the rotor's zero, if that lies apart by `zero`, give or take `known`. [rad]"""
    angle, reach = _electrical(plant, zero), _electrical(plant, known)
    frees = (Free("commutation_offset.angle", angle - reach, angle + reach, reach),)
    return Candidate("commutation_offset", frees, {}, ("angle",), (angle,))


def _commutation(plant: Actuator, zero: float) -> Candidate:
    c, recorded = _plain("commutation_offset", "angle", "apart"), _electrical(plant, zero)
    shown = (recorded, 0.0) if abs(zero) > plant.sensors.lvdt_step else ()
    return Commutation(**vars(replace(c, shown=shown)), recorded=recorded)


def _without_filter() -> Candidate:
    """Currents recorded as they are, or nearly: far from where the change of a filter has its column."""
    frees = (free("current_filter.change", 0.02),)
    return Candidate("current_filter", frees, {}, ("change",), (HARDLY_FILTERED,))


def candidates(
    plant: Actuator,
    data: Measured,
    torques: Sequence[Torque],
    line: str = "cogging",
    gear: Resonance | None = None,
    delays: Mapping[str, float] | None = None,
) -> list[Candidate]:
    """What to try on these cycles: what effects declare, and what the record or the residual torque suggests.

    A torque line is tried as the effect `line`: the first is cogging, a further one stands beside it. `gear` is the
    resonance that rotor and user show, `delays` what they show of effects that are late. [s]
    """
    delays = delays or {}
    shown = {"", *(["supply"] if all(s.u_dc is not None for s in data.signals) else [])}
    shown |= {"warming"} if np.ptp(data.dT) > WARMER else set()
    found = [
        _plain(effect.name, *look.linear, step=look.steps, **look.at)
        for effect in registry().values()
        for look in effect.looks
        if look.needs in shown and effect.name not in delays
    ]
    found += [Seen(**vars(replace(_plain(name, "time"), steps=(late,)))) for name, late in delays.items()]
    found += [_commutation(plant, data.zero or 0.0), _without_filter()]
    top = max(float(np.abs(s.i).max()) for s in data.signals)
    if np.isinf(data.ranges).all() and any(int((np.abs(s.i) > top - FLAT).sum()) >= FLAT_SAMPLES for s in data.signals):
        limit = Free("adc_saturation.limit", 0.5 * top, plant.sensors.adc_range, CLIPPED_STEP)
        found.append(Seen("adc_saturation", (limit,), {}, ("limit",), (top,)))
    if not torques:
        return found
    if gear is not None:
        step = {"compliance": gear.compliance}
        held_back = {name: x for name, x in (("drag", gear.drag), ("friction", gear.friction)) if x}
        c = _plain("gear_compliance", "compliance", step=step, inertia=gear.inertia, damping=gear.damping, **held_back)
        spring = (_plain("spring_load", "stiffness", step={"stiffness": gear.spring}),) if gear.spring else ()
        found.append(Seen(**vars(replace(c, beside=spring)), faults_seen={"k2": gear.k2}))
    for of in lines(torques):
        frees = (
            free(f"{line}.amplitude", 0.002),
            Free(f"{line}.order", max(of.order - 0.6, 1.0), of.order + 0.6, 0.04),
            Free(f"{line}.phase", -2.0 * np.pi, 2.0 * np.pi, 0.3),
        )
        found.append(Line(line, frees, {"order": of.order}, ("amplitude",), (0.005,), (of.sine, of.cosine)))
    for centre, width, height in bumps(torques):
        c = _plain("position_friction", "height", step={"centre": 0.25 * width}, centre=centre, width=width)
        F_d = plant.transmission.F_d
        found.append(replace(c, shown=(height / F_d,) if F_d > 0.0 else ()))
    return found
