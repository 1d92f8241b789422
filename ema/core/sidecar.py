"""The sidecar NAME.record.yaml beside NAME.csv: what columns mean and which rows are one cycle.

columns:
  Position: {channel: theta_m, unit: rad, sign: -1}
  Iq: {channel: i_q, unit: A, resolution: 0.001}
  Vsupply: ignore
cycles: {gap: 0.1 s}
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, PrivateAttr, field_validator, model_validator

from . import config
from .config import Settings
from .names import CHANNELS
from .units import convert, quantity

SUFFIX = ".record.yaml"


class Column(Settings):
    """One column of the file: channel value = sign · scale · number + offset, in `unit`."""

    channel: str
    unit: str | None = None
    scale: float = Field(default=1.0, gt=0, allow_inf_nan=False)
    sign: Literal[1, -1] = 1
    offset: float = Field(default=0.0, allow_inf_nan=False)
    resolution: float | None = Field(
        default=None, gt=0, allow_inf_nan=False, description="step of the measurement, in `unit`"
    )

    @field_validator("channel")
    @classmethod
    def _known(cls, name: str) -> str:
        if name not in CHANNELS and name != "cycle":
            raise ValueError(f"unknown channel, known are cycle, {', '.join(CHANNELS)}")
        return name

    @model_validator(mode="after")
    def _convertible(self) -> Column:
        if self.unit is not None and self.channel in CHANNELS:
            convert(self.unit, CHANNELS[self.channel].unit)
        return self


class Cycles(Settings):
    """Which rows are one cycle. Exactly one way is given; rows count from 0 below the header, stop excluded."""

    rows: tuple[tuple[int, int], ...] | None = None
    length: int | None = Field(default=None, ge=2)
    column: str | None = Field(
        default=None, description="consecutive rows with equal value in this column are one cycle"
    )
    gap: float | None = quantity("s", "a step of the time column longer than this begins a new cycle", None, gt=0)

    @model_validator(mode="after")
    def _one_way(self) -> Cycles:
        ways = [name for name in ("rows", "length", "column", "gap") if getattr(self, name) is not None]
        if len(ways) != 1:
            raise ValueError(f"give exactly one of rows, length, column, gap (given: {', '.join(ways) or 'none'})")
        for start, stop in self.rows or ():
            if not 0 <= start < stop:
                raise ValueError(f"rows [{start}, {stop}] must be 0 <= start < stop")
        return self


def _ignore(value: Any) -> Any:
    return None if value == "ignore" else value


class Sidecar(Settings):
    """Contents of NAME.record.yaml."""

    columns: dict[str, Annotated[Column | None, BeforeValidator(_ignore)]] = Field(default_factory=dict)
    delimiter: str | None = Field(
        default=None, min_length=1, max_length=1, description="' ' for any white space; else seen from the file"
    )
    decimal: Literal[".", ","] | None = Field(default=None, description="decimal sign; else seen from the file")
    encoding: Literal["utf-8-sig", "utf-8", "latin-1", "cp1252", "utf-16"] = "utf-8-sig"
    skip_rows: int = Field(default=0, ge=0, description="lines above the header")
    comment: str | None = Field(default=None, min_length=1, description="lines beginning with this text are skipped")
    at_rest: bool = Field(
        default=False,
        description="rows are readings at rest, or in the slowest motion, one after the other: a file without time",
    )
    cycles: Cycles | None = None
    note: str = ""
    _shared: bool = PrivateAttr(default=False)

    def whence(self, path: Path) -> str:
        """Where this is written, for messages about the record `path`."""
        return "the plant file, key 'record'" if self._shared else str(beside(path))


def beside(path: Path) -> Path:
    """Path of the sidecar of a record."""
    return path.with_name(path.stem + SUFFIX)


def of(path: Path, plan: Sidecar | None = None) -> Sidecar:
    """What is known of the record `path`: its sidecar; where it has none, `plan`, as a plant file gives it for all."""
    own = beside(path)
    if own.exists():
        return config.load(own, Sidecar)
    if plan is None:
        return Sidecar()
    shared = plan.model_copy()
    shared._shared = True
    return shared
