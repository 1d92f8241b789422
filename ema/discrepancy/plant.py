"""What the engine needs of a plant and its records."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from ema.core.records import Array

from .engine.hypothesis import Point as Point


@dataclass(frozen=True)
class Free:
    """A parameter to be fitted.

    `scale` is a change that matters (it conditions the search); `step` the change for a finite difference, above the
    simulation's own roughness; `prior` the standard deviation about `start` that is known beforehand, if any. A
    `is_shape` goes from one law to another: its ends are these laws, not the ends of what is credible. `rough` is the
    standard deviation that is left unknown of it where the misfit has many minima beside each other, as impacts make.
    """

    name: str
    unit: str
    low: float
    high: float
    start: float
    scale: float
    step: float = 0.0
    prior: float | None = None
    is_shape: bool = False
    rough: float = 0.0

    @property
    def difference(self) -> float:
        """Step of the finite difference."""
        return self.step or 1e-3 * self.scale


@dataclass(frozen=True)
class Candidate:
    """An effect, or a term of an unexplained structure, that may be added to the model.

    Parameters
    ----------
    key : str
        Unique in one round, for example ``"cogging"`` or ``"cogging:72"``.
    effect : str
        Name in the library (`ema.effects`), or of the kind of structure.
    free : tuple of Free
        Parameters to fit; their names are global.
    starts : tuple of Points
        Where searches begin; the best one counts. Also holds values that stay fixed during the fit.
    """

    key: str
    effect: str
    free: tuple[Free, ...]
    starts: tuple[Point, ...]
    is_structure: bool = False


@dataclass(frozen=True)
class Block:
    """An independent part of the records.

    `group` says from which record it is; blocks of one `stretch` of a group lie so close together that one must not
    be used to check what was fitted on another. `when` is its time in the record, where that has one course. [s]
    """

    group: str
    stretch: int = 0
    when: tuple[float, float] | None = None


@dataclass(frozen=True)
class Errors:
    """Error of a simulation over some blocks, without unit, and what noise alone would make of it.

    `weight` is how much the blocks count beside others of the same record.
    """

    error: float
    noise_floor: float
    weight: float = 1.0


@dataclass(frozen=True)
class Fitted:
    """Parameters that were fitted, with the covariance that noise alone gives them, shape (n_free, n_free)."""

    free: tuple[Free, ...]
    covariance: Array


class Plant(Protocol):
    """A plant with its records, see the package's description."""

    @property
    def base(self) -> Sequence[Free]:
        """Parameters free in every model."""
        ...

    @property
    def blocks(self) -> Sequence[Block]:
        """Independent parts of the records."""
        ...

    @property
    def noise_uncertainty(self) -> float:
        """Relative standard deviation of the noise model's amplitude: 0 where it was declared."""
        ...

    @property
    def noise_uncertainties(self) -> Sequence[float]:
        """The same for averages over `verdict.GROUPS` of samples."""
        ...

    def residuals(self, points: Sequence[Point], blocks: Sequence[int]) -> list[list[Array]]:
        """Whitened residuals by point and block, each of shape (n_channels, n_times)."""
        ...

    @property
    def noisier(self) -> Plant | None:
        """The same with a further draw of the noise of what drives the simulation; None where that shows none.

        What noise adds depends on the model: one that follows its drive with a lag takes noise from it.
        """
        ...

    def candidates(self, point: Point, blocks: Sequence[int]) -> Sequence[Candidate]:
        """Effects that could be added to the model at `point`, with starts found on `blocks` only."""
        ...

    def structure(self, point: Point, blocks: Sequence[int]) -> Sequence[Candidate]:
        """Terms the residual suggests, best first."""
        ...

    def errors(self, point: Point, blocks: Sequence[int], fitted: Fitted | None = None) -> Errors:
        """Error of the simulation and its noise floor, which holds what noise made of the parameters at `point`."""
        ...

    def is_of_sensor(self, candidate: Candidate) -> bool:
        """Whether it moves nothing, and is told by what one sensor shows beside another."""
        ...

    def free_run_errors(self, point: Point, blocks: Sequence[int]) -> list[Array]:
        """Error of the simulation in each block, scaled so that squares add to the relative error of its record."""
        ...

    def describe(
        self, candidates: Sequence[Candidate], point: Point, draw: Callable[[int], Sequence[Point]]
    ) -> list[dict[str, Any]]:
        """What was found, for findings.json: name, sentence, parameters with intervals. `draw` samples the
        uncertainty.
        """
        ...

    def describe_structure(self, terms: Sequence[Candidate], point: Point) -> dict[str, Any]:
        """Terms without a name, for findings.json: sentences, orders, frequencies, what they depend on."""
        ...
