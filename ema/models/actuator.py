"""The actuator's configuration: every number of the three-phase plant with unit, meaning and range."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, FiniteFloat, model_validator

from ema.core.config import Settings
from ema.core.sidecar import Sidecar
from ema.core.units import plain, quantity


class Motor(Settings):
    """Wye-connected three-phase brushless motor with trapezoidal back-EMF."""

    R: float = quantity("ohm", "phase resistance at 20 °C", gt=0, le=100)
    L: float = quantity("H", "phase inductance", gt=1e-6, le=1)
    k_e: float = quantity("V s/rad", "back-EMF = torque coefficient of one phase, flat top", gt=0, le=100)
    p: int = Field(ge=1, le=50, description="pole pairs")
    theta_0: float = quantity("rad", "electrical angle of the rotor at θ_m = 0", 0.0, ge=-7, le=7)
    J_m: float = quantity("kg m^2", "inertia of rotor and reflected gears", gt=0, le=10)
    C: float = quantity("N m s/rad", "viscous coefficient", ge=0, le=1)
    phi: float = quantity("rad", "direction of the eccentricity", 0.0, ge=-7, le=7)


class Inverter(Settings):
    """Two-level inverter with hysteresis current control."""

    V_dc: float = quantity("V", "DC bus voltage", gt=0, le=2000)
    h: float = quantity("A", "half-band of the comparators", gt=0, le=100)
    I_max: float = quantity("A", "limit of the reference current", gt=0, le=1000)


class Transmission(Settings):
    """Gear train: ratio, dry friction, backlash, end stops."""

    GR: float = quantity("", "gear ratio", ge=1, le=1e5)
    F_s: float = quantity("N m", "static friction at the motor shaft", ge=0, le=10)
    F_d: float = quantity("N m", "sliding friction at the motor shaft", ge=0, le=10)
    b: float = quantity("rad", "half-width of the backlash at the user", ge=0, le=0.1)
    F_u: float | None = quantity(
        "N m",
        "friction at the user: a load beyond it moves the user within the backlash; none: it holds against any load",
        None,
        ge=0,
        le=1e5,
        exclude_if=lambda F_u: F_u is None,  # such plants keep their hash
    )
    theta_stop: float = quantity("rad", "end of travel of the user", gt=0, le=10)

    @model_validator(mode="after")
    def _static_not_below_sliding(self) -> Transmission:
        if self.F_s < self.F_d:
            raise ValueError(
                f"static friction F_s = {self.F_s} N m must not be below sliding friction F_d = {self.F_d} N m"
            )
        return self


class Control(Settings):
    """Cascade of two proportional controllers."""

    K_p: float = quantity("1/s", "gain of the position loop", gt=0, le=1e7)
    K_w: float = quantity("A s/rad", "gain of the speed loop", gt=0, le=100)
    rate: float = quantity("Hz", "rate of control and sampling", 1e4, ge=1000, le=1e5)


class Sensors(Settings):
    """Measurement chains of user position and phase currents."""

    lvdt_step: float = quantity("rad", "resolution of the user position", gt=0, le=0.01)
    lvdt_noise: float = quantity("rad", "rms noise of the user position before its ADC", ge=0, le=0.01)
    f_lag: float = quantity("Hz", "corner of each of two anti-alias stages", gt=10, le=1e5)
    adc_range: float = quantity("A", "range of the current ADC, ±", gt=0, le=1000)
    adc_bits: int = Field(ge=6, le=24, description="bits of the current ADC")
    current_noise: float = quantity("A", "rms noise of the measured currents", ge=0, le=10)

    @property
    def lvdt_sd(self) -> float:
        """Standard deviation of one measured user position. [rad]"""
        return float(np.sqrt(self.lvdt_step**2 / 12.0 + self.lvdt_noise**2))

    def positions(self, theta_u: float, n: int, rng: np.random.Generator) -> np.ndarray:
        """`n` positions at which the user may be when `theta_u` is measured, shape (n,). [rad]"""
        return theta_u + self.lvdt_step * (rng.random(n) - 0.5) + self.lvdt_noise * rng.standard_normal(n)

    @property
    def adc_step(self) -> float:
        """Resolution of the measured currents. [A]"""
        return 2.0 * self.adc_range / 2**self.adc_bits


class Motion(Settings):
    """The test motion: a chirp of the commanded user position."""

    kind: Literal["chirp"] = "chirp"
    amplitude: float = quantity("rad", "amplitude", gt=0, le=1)
    f_start: float = quantity("Hz", "frequency at the start", ge=0, le=200)
    f_end: float = quantity("Hz", "frequency at the end", ge=0, le=200)
    duration: float = quantity("s", "duration", ge=0.05, le=60)

    def command(self, t: np.ndarray) -> np.ndarray:
        """Commanded user position.   θ_cmd = A sin 2π (f₀ t + (f₁ - f₀) t² / 2T)   [rad]"""
        phase = self.f_start * t + (self.f_end - self.f_start) * t**2 / (2.0 * self.duration)
        return self.amplitude * np.sin(2.0 * np.pi * phase)


class Actuator(Settings):
    """The three-phase plant, `kind: ema`."""

    kind: Literal["ema"] = "ema"
    name: str = Field(default="actuator", min_length=1, max_length=80)
    motor: Motor
    inverter: Inverter
    transmission: Transmission
    control: Control
    sensors: Sensors
    motion: Motion
    effects: dict[str, dict[str, Annotated[FiniteFloat, BeforeValidator(plain)]]] = Field(
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

    @property
    def n_samples(self) -> int:
        """Samples of one cycle, both ends included."""
        return round(self.motion.duration * self.control.rate) + 1

    def time(self) -> np.ndarray:
        """Sample times of one cycle, shape (n_samples,). [s]"""
        return np.arange(self.n_samples) / self.control.rate

    def command(self) -> np.ndarray:
        """The test motion at the sample times, shape (n_samples,). [rad]"""
        return self.motion.command(self.time())
