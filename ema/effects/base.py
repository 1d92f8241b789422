"""What an effect is: one physical term, its parameters, and what an engineer would say of it.

An effect file defines one `EFFECT`. Its laws are pure scalar functions of plain floats, written so that a
JIT can run them on many lanes at once: no branches but conditional expressions, `vector_math` instead of `math`.
Each law belongs to a *hook*, the place in the models' equations where it enters; every model calls the same law.

====================  =========================================================  ======================  ========
hook                  arguments before the parameters                            combined by             neutral
====================  =========================================================  ======================  ========
shaft_torque          θ_m [rad], ω_m [rad/s], θ_u [rad], i_q [A]                 sum, opposes motion     0 N m
drifting_torque       ω_m, t [s] of the cycle, ΔT [K]                            sum, opposes motion     0 N m
drifting_friction     t, ΔT                                                      product on F_s and F_d  1
tabulated_torque      the same (see below)                                       sum, opposes motion     0 N m
static_friction       θ_m, ω_m, θ_u, direction (±1), τ_load [N m]                product on F_s          1
sliding_friction      θ_m, ω_m, θ_u, direction (±1), τ_load [N m]                product on F_d          1
user_torque           θ_u [rad]                                                  sum, opposes the user   0 N m
emf_factor            i_j [A], ΔT [K]                                            product on κ_j          1
resistance_factor     ΔT [K]                                                     product on R_j          1
inductance_factor     i_j [A]                                                    product on L_j          1
angle_error           θ_m [rad]                                                  sum, on the resolver    0 rad
position_error        θ_m [rad]                                                  sum, on the angle only  0 rad
inertia_share         θ_m [rad]                                                  sum, of the inertia     0
inertia_slope         the same                                                   sum, its slope          0 1/rad
====================  =========================================================  ======================  ========

ΔT is the winding temperature less `T_REFERENCE`. The speed of a resolver has the slope of its angle's error; an error
on the angle only leaves a speed from another sensor as it is. What drifts, and an inertia that changes with the angle,
the axis model has. A tabulated torque is a
shaft torque that costs a fifth of a step.
A kernel is compiled with those parts of the library only that its runs need (`ema.models.parts`). An effect without
laws is *structural*: the model itself reads its parameters (a delay, a dead time, a second inertia).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from string import Formatter
from types import MappingProxyType
from typing import Literal, NamedTuple

from .search import Look, OnAxis

HOOKS = MappingProxyType(
    {
        "shaft_torque": ("sum", 4),
        "tabulated_torque": ("sum", 4),
        "drifting_torque": ("sum", 3),
        "drifting_friction": ("product", 2),
        "static_friction": ("product", 5),
        "sliding_friction": ("product", 5),
        "user_torque": ("sum", 1),
        "emf_factor": ("product", 2),
        "resistance_factor": ("product", 1),
        "inductance_factor": ("product", 1),
        "angle_error": ("sum", 1),
        "position_error": ("sum", 1),
        "inertia_share": ("sum", 1),
        "inertia_slope": ("sum", 1),
    }
)


T_REFERENCE = 20.0  # [°C] winding temperature that a plant's numbers belong to
ONE_STEP = 1e-6  # [s] within which simulations sample, decide and act in one order or another
ABSENT = -1.0  # a relative change: nothing is left


class Limit(NamedTuple):
    """What a value must be so that it can be simulated at all, credible or not."""

    says: str
    holds: Callable[[float], bool]


POSITIVE = Limit("above 0", lambda x: x > 0.0)
NOT_NEGATIVE = Limit("at least 0", lambda x: x >= 0.0)
SOME_LEFT = Limit("above -1", lambda x: x > ABSENT)  # of a relative change
SHARE = Limit("between -1 and 1", lambda x: abs(x) < 1.0)
PART = Limit("between 0 and 1", lambda x: 0.0 <= x <= 1.0)
NOT_REVERSED = Limit("at least -1", lambda x: x >= ABSENT)


@dataclass(frozen=True)
class Parameter:
    """One number of an effect: `neutral` switches the effect off, `low`..`high` is what is physically credible.

    `start` is where a search begins (never the neutral value where the effect has no slope there). Where `low` or
    `high` is in `laws_at`, a law ends there and not what somebody held credible: a fit may well go there.
    """

    name: str
    unit: str
    neutral: float
    low: float
    high: float
    start: float
    meaning: str
    laws_at: tuple[float, ...] = ()


@dataclass(frozen=True)
class Effect:
    """One physical term.

    Parameters
    ----------
    sentence : str
        What an engineer would say, with the parameters' names in braces.
    besides : mapping of str to str
        What is added to the sentence where the parameter of that name is not neutral; several with "and" between.
    mistaken_for : tuple of str
        Faults a monitor without this effect would report.
    separated_by : str
        The experiment (motion, temperature, channel) that tells it from its look-alikes.
    plants : tuple of str
        Plants in which it has a meaning: ``ema`` (three-phase actuator), ``axis`` (single inertia or mass).
    limits : mapping of str to Limit
        Of parameters that cannot have just any value.
    least_sd : mapping of str to float
        Standard deviation below which no estimate is claimed, where honest simulations of the same law differ by it;
        nor is an effect, within a few of these.
    place : str
        Where it acts: in the ``plant``, on a signal of the control ``loop``, or in the ``recorder`` alone, which the
        controller does not notice.
    looks : tuple of Look
        How a search looks for it on a three-phase actuator, if it need not be seen in the record first.
    on_axis : function AxisSizes → spans of parameters, optional
        Where a search looks for it on an axis, if it need not be seen in the balance of torque first.
    acts_at_rest : bool
        Whether it says what friction does before it slides, so that a simulation with it knows an axis that creeps.
    derived : mapping of str to function values → number or word
        What the sentence tells besides the parameters.
    product : pair of str, optional
        Parameters whose product a record tells far better than either.
    """

    name: str
    parameters: tuple[Parameter, ...]
    sentence: str
    separated_by: str
    laws: Mapping[str, Callable[..., float]] = field(default_factory=dict)
    mistaken_for: tuple[str, ...] = ()
    plants: tuple[str, ...] = ("ema",)
    besides: Mapping[str, str] = field(default_factory=dict)
    limits: Mapping[str, Limit] = field(default_factory=dict)
    least_sd: Mapping[str, float] = field(default_factory=dict)
    place: Literal["plant", "loop", "recorder"] = "plant"
    looks: tuple[Look, ...] = ()
    on_axis: OnAxis | None = None
    acts_at_rest: bool = False
    derived: Mapping[str, Callable[[Mapping[str, float]], float | str]] = field(default_factory=dict)
    product: tuple[str, str] | None = None

    def __post_init__(self) -> None:
        unknown = set(self.laws) - set(HOOKS)
        if unknown:
            raise ValueError(f"effect {self.name}: unknown hooks {sorted(unknown)}; known: {sorted(HOOKS)}")
        named = {name for look in self.looks for name in (*look.linear, *look.steps, *look.at)}
        parameters = {p.name for p in self.parameters}
        if strange := named - parameters:
            raise ValueError(f"effect {self.name}: a look at {sorted(strange)}, which are none of its parameters")
        if strange := {*(self.product or ())} - parameters:
            raise ValueError(f"effect {self.name}: a product of {sorted(strange)}, which are none of its parameters")

    @property
    def multiplies_friction(self) -> bool:
        """Whether it is a share of dry friction, which means nothing where there is next to none."""
        return bool(self.laws) and all(hook.endswith("_friction") for hook in self.laws)

    @property
    def shares_of_friction(self) -> tuple[str, ...]:
        """Parameters that are shares of dry friction: those that the sentence names without a format of their own."""
        if not self.multiplies_friction:
            return ()
        return tuple(name for _, name, how, _ in Formatter().parse(self.sentence) if name and not how)

    @property
    def is_table(self) -> bool:
        """Whether it is a tabulated function of no known cause: no single value of it means anything."""
        return "tabulated_torque" in self.laws

    def neutral(self) -> dict[str, float]:
        """Values that switch the effect off."""
        return {p.name: p.neutral for p in self.parameters}

    def said(self, values: Mapping[str, float], friction: float | None = None) -> str:
        """The sentence with these values; parameters that are not among them are neutral.

        A share of dry friction is told as the torque that it makes of `friction` [N m], or in per cent where that is
        not given.
        """
        neutral = self.neutral()
        full = {**neutral, **values}
        besides = [text for name, text in self.besides.items() if full[name] != neutral[name]]
        told: dict[str, float | str] = {**full, **{name: of(full) for name, of in self.derived.items()}}
        for name in self.shares_of_friction:
            told[name] = f"{100.0 * full[name]:.3g}%" if friction is None else f"{full[name] * friction:.3g} N m"
        return (self.sentence + " and".join(besides)).format(**told)
