"""The configuration of a single axis: one inertia or mass driven by a measured current, voltage or force."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from ema.core import config
from ema.core.config import Settings
from ema.core.names import CHANNELS
from ema.core.sidecar import Sidecar
from ema.core.units import plain, quantity, to_unit
from ema.effects import checked
from ema.effects.torque_term import COLUMNS

from .gear_orders import gear_orders

INSTANCE = "#"  # cogging#2 is a second cogging line
LINES = ("cogging", "gear_error", "external_torque", "position_line")  # effects of which there may be several


def _noise(value: Any, info: ValidationInfo) -> Any:
    if not isinstance(value, dict):
        return value
    unknown = sorted(set(value) - set(CHANNELS))
    if unknown:
        raise ValueError(f"unknown channel {', '.join(unknown)}")
    return {name: to_unit(x, CHANNELS[name].unit) if isinstance(x, str) else x for name, x in value.items()}


BEYOND_GEAR = ("gear_compliance", "drive_compliance", "gear_play")  # effects that take a part of the inertia there


class SpeedLoop(Settings):
    """Proportional speed control:  i_q = sat(K_w (ω_ref - ω_m), ±I_max)."""

    K_w: float = quantity("A s/rad", "gain of the speed loop", gt=0, le=1e4)
    I_max: float = quantity("A", "limit of the current", 1e6, gt=0)


class PositionLoop(Settings):
    """A drive's position loop:  y = sat(K_p (θ_ref - θ) + K_d (k_v ω_ref - ω) + F_c sign ω_ref, ±limit).

    A cascade of position and speed loops is one with K_d = K_w and K_p = K_w times the gain of its position loop.
    """

    gives: Literal["current", "voltage", "torque", "force", "duty"] = "current"
    K_p: float = Field(ge=0, le=1e9, allow_inf_nan=False, description="y per position error")
    K_d: float = Field(default=0.0, ge=0, le=1e9, allow_inf_nan=False, description="y per speed error")
    k_v: float = Field(default=1.0, ge=0, le=10, description="share of the commanded speed that is fed forward")
    F_c: float = Field(default=0.0, ge=0, le=1e9, description="friction compensation of the firmware, in units of y")
    limit: float = Field(default=1e9, gt=0, le=1e9, description="largest y")


class Axis(Settings):
    """What rotary and linear axes share. `fitted` names parameters whose plant-file values are only a start."""

    kind: Literal["axis"] = "axis"
    name: str = Field(default="axis", min_length=1, max_length=80)
    drive: Literal["current", "voltage", "force", "torque", "speed-loop"] = "current"
    torque_at: Literal["motor", "load"] = Field(
        default="motor", description="side of the gear on which a driving torque was measured"
    )
    gear: float = Field(default=1.0, gt=0, le=1e5, description="turns of the motor per turn of the load")
    measured_at: Literal["motor", "load"] = Field(
        default="motor",
        description="side of the gear whose position, speed and inertia the plant file and records have",
    )
    position_loop: PositionLoop | None = None
    neighbour: Literal["inner", "outer"] | None = Field(
        default=None, description="where the axis of the channel theta_n is: before this one, or on its link"
    )
    R: float | None = quantity("ohm", "resistance seen by the drive voltage", None, ge=0, le=1e4)
    L: float | None = quantity("H", "inductance seen by the drive voltage", None, ge=0, le=10)
    V_dc: float | None = quantity("V", "supply without load, for which u_q is commanded", None, gt=0, le=1e5)
    loop: SpeedLoop | None = None
    fitted: tuple[Literal["J", "M", "C", "k_t", "k_e", "R", "L"], ...] = ()
    noise: Annotated[dict[str, float], BeforeValidator(_noise)] = Field(
        default_factory=dict, description="rms noise by channel [unit of the channel]; estimated where not given"
    )
    window: float | None = quantity(
        "s", "length of the parts of a record that are simulated on their own; chosen if not given", None, gt=0, le=1e3
    )
    effects: dict[str, dict[str, Annotated[float, BeforeValidator(plain)]]] = Field(
        default_factory=dict, description="terms beyond the nominal model"
    )
    record: Sidecar | None = Field(
        default=None,
        exclude=True,
        description="what the columns of records are, where they have no sidecar",
    )
    intervals: dict[str, dict[str, tuple[float, float]]] = Field(
        default_factory=dict, exclude=True, description="of 95 %, of the effects' parameters, where they were measured"
    )
    structure: tuple[dict[str, float], ...] = Field(
        default=(), description="terms without a name, as `ema discrepancy` found them"
    )

    @field_validator("noise")
    @classmethod
    def _positive(cls, noise: dict[str, float]) -> dict[str, float]:
        for name, rms in noise.items():
            if not 0.0 < rms < 1e12:
                raise ValueError(f"noise of {name} must be positive")
        return noise

    @field_validator("effects")
    @classmethod
    def _known_effects(cls, effects: dict[str, dict[str, float]]) -> dict[str, dict[str, float]]:
        for key, values in effects.items():
            name = key.split(INSTANCE)[0]
            if key != name and name not in LINES:
                raise ValueError(f"effect '{key}': only {' and '.join(LINES)} may occur more than once")
            checked({name: values}, "axis")
        return effects

    @field_validator("structure")
    @classmethod
    def _known_columns(cls, structure: tuple[dict[str, float], ...]) -> tuple[dict[str, float], ...]:
        unknown = sorted({name for term in structure for name in term} - set(COLUMNS))
        if unknown:
            raise ValueError(f"unknown {', '.join(unknown)}; known: {', '.join(COLUMNS)}")
        return structure

    @model_validator(mode="after")
    def _complete(self) -> Axis:
        if self.drive == "voltage" and (self.R is None or self.k_e is None or self.k_t is None):
            raise ValueError("drive: voltage needs R, k_e and k_t")
        if self.drive in ("current", "speed-loop") and self.k_t is None:
            raise ValueError(f"drive: {self.drive} needs k_t")
        rotary = self.motion == "rotary"
        if self.drive == ("force" if rotary else "torque"):
            raise ValueError(
                f"drive: {self.drive} is of a {'linear' if rotary else 'rotary'} axis: use "
                f"{'torque' if rotary else 'force'}"
            )
        if self.drive == "speed-loop" and self.loop is None:
            raise ValueError("drive: speed-loop needs loop: {K_w: …}")
        if "supply_sag" in self.effects and self.V_dc is None:
            raise ValueError("effect 'supply_sag' needs V_dc, the supply without load")
        for name in BEYOND_GEAR:
            beyond = self.effects.get(name, {}).get("inertia")
            if beyond is not None and not 0.0 < beyond < self.inertia:
                raise ValueError(f"{name}: the inertia beyond the gear, {beyond:g}, must be part of {self.inertia:g}")
        if self.F_s is not None and self.F_s < self.F_d:
            raise ValueError(f"static friction F_s = {self.F_s} must not be below sliding friction F_d = {self.F_d}")
        for name in self.fitted:
            if getattr(self, name, None) is None:
                raise ValueError(f"'{name}' is to be fitted and has no value to start from")
        return self

    # declared with their units by the two kinds of axis
    motion: Literal["rotary", "linear"]
    F_d: float
    F_s: float | None
    C: float
    k_t: float | None
    k_e: float | None

    @property
    def gear_orders(self) -> Mapping[float, str]:
        """Orders at which the gear may err, per turn of the measured side, each with what makes it."""
        return {}

    @property
    def is_linear(self) -> bool:
        """Whether it slides: position in metres, forces in newtons."""
        return self.motion == "linear"

    @property
    def is_force(self) -> bool:
        """Whether a measured force or torque drives."""
        return self.drive in ("force", "torque")

    @property
    def inertia(self) -> float:
        """Inertia [kg m²] or mass [kg]."""
        raise NotImplementedError


class RotaryAxis(Axis):
    """One inertia."""

    motion: Literal["rotary"] = "rotary"
    J: float = quantity("kg m^2", "inertia", gt=0, le=1e6)
    F_d: float = quantity("N m", "sliding friction", ge=0, le=1e6)
    F_s: float | None = quantity("N m", "static friction; that of sliding if not given", None, ge=0, le=1e6)
    C: float = quantity("N m s/rad", "viscous coefficient", 0.0, ge=0, le=1e6)
    k_t: float | None = quantity("N m/A", "torque per current", None, gt=0, le=1e4)
    k_e: float | None = quantity("V s/rad", "back-EMF per speed", None, gt=0, le=1e4)
    p: int | None = Field(default=None, ge=1, le=200, description="pole pairs")
    slots: int | None = Field(default=None, ge=1, le=1000, description="slots of the stator")
    gear_kind: Literal["harmonic", "planetary", "spur"] | None = Field(
        default=None, description="kind of the gear between motor and load: gear errors are looked for at its orders"
    )
    teeth: tuple[int, ...] = Field(
        default=(),
        description="of a planetary gear: sun, ring; of spur gears: driving and driven wheel, stage by stage",
    )

    @model_validator(mode="after")
    def _teeth_fit(self) -> RotaryAxis:
        fits = {"planetary": len(self.teeth) == 2, "spur": len(self.teeth) >= 2 and len(self.teeth) % 2 == 0}
        if self.gear_kind and self.gear == 1.0:
            raise ValueError("gear_kind needs gear: turns of the motor per turn of the load")
        if not fits.get(self.gear_kind or "", True) or any(z < 1 for z in self.teeth):
            raise ValueError(
                "teeth: a planetary gear has two numbers (sun, ring), spur gears two for each stage (driving, driven)"
            )
        if self.gear_kind == "planetary" and self.teeth[0] >= self.teeth[1]:
            raise ValueError(f"teeth: the sun has fewer teeth than the ring, not {self.teeth[0]} and {self.teeth[1]}")
        return self

    @property
    def gear_orders(self) -> Mapping[float, str]:
        """Orders at which the gear may err, per turn of the measured side, each with what makes it."""
        if self.gear_kind is None:
            return {}
        turns = self.gear if self.measured_at == "load" else 1.0
        return {n * turns: what for n, what in gear_orders(self.gear_kind, self.gear, self.teeth).items()}

    @property
    def inertia(self) -> float:
        """Inertia. [kg m²]"""
        return self.J


class LinearAxis(Axis):
    """One mass."""

    motion: Literal["linear"]
    M: float = quantity("kg", "mass", gt=0, le=1e9)
    F_d: float = quantity("N", "sliding friction", ge=0, le=1e9)
    F_s: float | None = quantity("N", "static friction; that of sliding if not given", None, ge=0, le=1e9)
    C: float = quantity("N s/m", "viscous coefficient", 0.0, ge=0, le=1e9)
    k_t: float | None = quantity("N/A", "force per current", None, gt=0, le=1e6)
    k_e: float | None = quantity("V s/m", "back-EMF per speed", None, gt=0, le=1e6)

    @property
    def inertia(self) -> float:
        """Mass. [kg]"""
        return self.M


def load(path: Any) -> RotaryAxis | LinearAxis:
    """Read an axis plant file."""
    data = config.read_yaml(path)
    if data.get("motion") == "linear":
        return config.validate(data, LinearAxis, path)
    return config.validate(data, RotaryAxis, path)
