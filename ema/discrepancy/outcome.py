"""What the engine found, before a plant puts it into the words of findings.json."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from .folds import Folds
from .grade import Left, Verdict
from .plant import Point
from .selection import Tried


@dataclass(frozen=True)
class RecordGain:
    """Errors of one record on held-out blocks, and what noise makes of them; `rms`: whitened residual (1 is noise)."""

    name: str
    err_before: float
    err_after: float
    noise_floor: float
    rms_before: float
    rms_after: float


@dataclass(frozen=True)
class Outcome:
    """Outcome of one examination.

    Attributes
    ----------
    verdict : str
        See `grade`.
    because : str
        What the verdict on the plain model rests on.
    effects : list of dict
        Name, sentence, confidence, what it cannot be told from, the experiment that would tell, parameters.
    structure : dict
        Terms without a name: orders, frequencies, dependence.
    train : two floats
        Error before and after on the parts that were fitted.
    folds : Folds
        The same of every part held out.
    mimicked : tuple of str
        Effects that, if they were there, would be taken for a change of the base parameters on these records.
    k_error : tuple of float
        Standard deviations of `k_after`.
    rest : float
        Residual over noise where the final model leaves more than noise, 0 where it does not.
    lost : list of dict
        Effects that foretell held-out parts, but worse than the one that is in their place: as in `Findings.rejected`.
    posterior : list of dict
        Sets of effects with their probabilities: as in `Findings.posterior`.
    point : Point
        All fitted values of the final model.
    model : Tried
        That model, by held-out parts.
    """

    verdict: Verdict
    because: str
    p_value: float
    effects: list[dict[str, Any]]
    structure: dict[str, Any]
    train: tuple[float, float]
    folds: Folds
    left: Left
    base: list[str]
    k_before: list[float]
    k_after: list[float]
    records: list[RecordGain]
    tried: list[dict[str, Any]]
    mimicked: tuple[str, ...] = ()
    k_error: tuple[float, ...] = ()
    point: Point = field(default_factory=dict)
    model: Tried = field(default_factory=lambda: Tried((), (), (), ()))
    notes: list[str] = field(default_factory=list)
    rest: float = 0.0
    lost: list[dict[str, Any]] = field(default_factory=list)
    posterior: list[dict[str, Any]] = field(default_factory=list)
