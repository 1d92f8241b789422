"""Nuisance parameters: what an actuator does besides its faults, estimated beside k and never told as a fault.

The unknowns become x = [k; ν]. An element of ν is a parameter θ of an effect in units in which it moves the envelope
about as much as a fault does, θ = θ₀ + s ν, with bounds and a normal prior ν ~ N(0, (σ/s)²), which stands as one more
row of the least squares. What the data cannot tell from a fault widens the fault's interval instead of becoming one.

An effect may look nearly like a sum of faults: ∂i/∂ν = A d + n with a small n (a weaker magnet and three shorted phases
differ by 4 % of their response). Two more assumptions are then needed, and are made here and nowhere else:

- *shape*: the part n by which the two differ is trusted no further than to `SHAPE` of the whole response;
- *faults are rare*: the faults d together are small beforehand, d·k/‖d‖ ~ N(0, `TOGETHER`²), since an effect that is
  expected to change is a likelier cause than several faults that grow alike.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.special import chdtri, ndtri

from ema.faults import N_FAULTS

from .measurement import Measurement
from .truncated import Marginals
from .weighted import Whitener, bounded_least_squares

if TYPE_CHECKING:
    from . import Estimate, Identifier

RULED_OUT = 9.0  # χ² by which another explanation must be worse to be ruled out: three standard deviations
MATTERS = 0.02  # difference in a fault that an operator would be told of
MIMICRY = 0.5  # correlation from which a nuisance can be mistaken for a fault
RESOLUTION = 1e-4  # of the limits of an interval [share of a complete failure]
SHAPE = 0.05  # share of an effect's response to which its shape is trusted
TOGETHER = 0.07  # of a complete failure: faults that look like an effect, all together
LOOKS_ALIKE = 0.2  # share of an effect's response that no sum of faults explains, below which it looks like faults


@dataclass(frozen=True)
class Nuisance:
    """The nuisance parameters of a bundle.

    Attributes
    ----------
    names, units : tuple of str
        ``effect.parameter`` and its unit.
    centre, scale, low, high, sd : arrays, shape (m,)
        θ₀, s, bounds and the prior's standard deviation σ. [units]
    mimicked : array, shape (m, 6)
        Direction of the faults a parameter looks like (unit vectors), zero where it looks like none.
    """

    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    centre: np.ndarray = field(default_factory=lambda: np.zeros(0))
    scale: np.ndarray = field(default_factory=lambda: np.zeros(0))
    low: np.ndarray = field(default_factory=lambda: np.zeros(0))
    high: np.ndarray = field(default_factory=lambda: np.zeros(0))
    sd: np.ndarray = field(default_factory=lambda: np.zeros(0))

    mimicked: np.ndarray = field(default_factory=lambda: np.zeros((0, N_FAULTS)))

    def __len__(self) -> int:
        return len(self.names)

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Of x, two arrays of shape (6 + m,)."""
        low, high = (self.low - self.centre) / self.scale, (self.high - self.centre) / self.scale
        return np.concatenate([np.zeros(N_FAULTS), low]), np.concatenate([np.ones(N_FAULTS), high])

    @cached_property
    def prior(self) -> np.ndarray:
        """Rows P of the least squares, P x ~ N(0, 1); shape (up to 2 m, 6 + m)."""
        m = len(self)
        own = np.hstack([np.zeros((m, N_FAULTS)), np.diag(self.scale / self.sd)])
        faults = self.mimicked[self.mimicked.any(axis=1)] / TOGETHER
        return np.vstack([own, np.hstack([faults, np.zeros((len(faults), m))])])

    def seen(self, A: np.ndarray, S: np.ndarray) -> Nuisance:
        """The same, with what the faults a parameter looks like are.

        Parameters
        ----------
        A : array, shape (n_omega, 6 + m)
            Jacobian ∂i/∂x at zero. [A]
        S : array, shape (n_omega, n_omega)
            Switching covariance. [A²]
        """
        D, _, share = _likeness(A, Whitener(S))
        alike = (share < LOOKS_ALIKE)[:, None]
        return replace(self, mimicked=np.where(alike, D / np.linalg.norm(D, axis=1, keepdims=True), 0.0))

    def untrusted(self, x: np.ndarray, A: np.ndarray, S: np.ndarray) -> np.ndarray:
        """Covariance of what is not trusted of the responses' shape at x, (n, n) [A²]; A and S of the n valid instants.

        The response meant is that of ν and of the faults that look like it together: c = ν + d·k/‖d‖² is the
        same for every explanation of one excursion.
        """
        D, rest, share = _likeness(A, Whitener(S))
        c = x[N_FAULTS:] + D @ x[:N_FAULTS] / np.sum(D**2, axis=1)
        moved = np.where(share < LOOKS_ALIKE, SHAPE / share * c, 0.0) * rest
        return np.asarray(moved @ moved.T)

    def physical(self, nu: np.ndarray) -> np.ndarray:
        """θ of ν, shape (..., m)."""
        return np.asarray(self.centre + self.scale * nu)

    def started_by(self, first: Identifier) -> Callable[[Measurement], np.ndarray]:
        """Where an iteration begins: the point x (6 + m,) of another identifier's answer."""

        return lambda measurement: self.point(first.estimate(measurement))

    def point(self, e: Estimate) -> np.ndarray:
        """x of an estimate, shape (6 + m,)."""
        nu = np.zeros(len(self)) if e.nuisance is None else (e.nuisance.value - self.centre) / self.scale
        return np.concatenate([e.k, nu])

    def spread(self, e: Estimate) -> np.ndarray:
        """Covariance of x of an estimate, before the bounds, shape (6 + m, 6 + m)."""
        if e.nuisance is None:
            return e.covariance
        units = np.concatenate([np.ones(N_FAULTS), self.scale])
        with_k = e.nuisance.covariance / self.scale[:, None] / units
        return np.vstack([np.hstack([e.covariance, with_k[:, :N_FAULTS].T]), with_k])

    def effects(self, x: np.ndarray, declared: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, Any]]:
        """Effects at points `x` (n, 6 + m) as the HF model takes them; `declared` are the plant's own."""
        values: dict[str, dict[str, Any]] = {}
        for name, column in zip(self.names, self.physical(x[:, N_FAULTS:]).T, strict=True):
            effect, parameter = name.split(".")
            values.setdefault(effect, dict(declared.get(effect, {})))[parameter] = column
        return values

    def as_list(self) -> list[dict[str, Any]]:
        """As kept in a bundle's manifest."""
        numbers = {name: getattr(self, name).tolist() for name in ("centre", "scale", "low", "high", "sd")}
        return [
            {"parameter": name, "unit": unit, **{key: values[j] for key, values in numbers.items()}}
            for j, (name, unit) in enumerate(zip(self.names, self.units, strict=True))
        ]

    @classmethod
    def of(cls, entries: Sequence[Mapping[str, Any]]) -> Nuisance:
        """From a bundle's manifest; KeyError, TypeError or ValueError where that is damaged."""
        numbers = [np.array([float(e[key]) for e in entries]) for key in ("centre", "scale", "low", "high", "sd")]
        made = cls(tuple(str(e["parameter"]) for e in entries), tuple(str(e["unit"]) for e in entries), *numbers)
        if not all(np.isfinite(x).all() for x in numbers) or (made.scale <= 0).any() or (made.sd <= 0).any():
            raise ValueError("numbers")
        return made


@dataclass(frozen=True)
class NuisanceEstimate:
    """Nuisance parameters of one cycle.

    Attributes
    ----------
    names, units : tuple of str
    value, sd : arrays, shape (m,)
        In their units; sd is the root mean square error expected.
    covariance : array, shape (m, 6 + m)
        With the faults and among each other, before the bounds.
    interval95 : array, shape (m, 2)
        Limits between which each parameter lies with a probability of 95 %.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    value: np.ndarray
    sd: np.ndarray
    covariance: np.ndarray
    interval95: np.ndarray


def _likeness(A: np.ndarray, white: Whitener) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """N = A_k d + n: d (m, 6), n (n_omega, m), and the share ‖n‖/‖N‖ (m,) of whitened responses."""
    A_k, N = A[:, :N_FAULTS], A[:, N_FAULTS:]
    D = np.linalg.lstsq(white(A_k), white(N), rcond=None)[0].T
    rest = N - A_k @ D.T
    return D, rest, np.linalg.norm(white(rest), axis=0) / np.linalg.norm(white(N), axis=0)


def estimated(
    nuisance: Nuisance, x: np.ndarray, covariance: np.ndarray, marginals: Marginals, edges: Edges
) -> NuisanceEstimate:
    """The part of a solution that is no fault, in physical units.

    Parameters
    ----------
    x : array, shape (6 + m,)
    covariance : array, shape (6 + m, 6 + m)
    marginals : Marginals
        Of u = (ν - low)/(high - low), shape (m,).
    """
    low, high = (side[N_FAULTS:] for side in nuisance.bounds)
    span, s = high - low, nuisance.scale
    mean = low + span * marginals.mean
    sd = s * np.sqrt(span**2 * marginals.variance + (mean - x[N_FAULTS:]) ** 2)
    limits = low[:, None] + span[:, None] * marginals.shortest(0.95)
    limits = edges.widened(limits, 0.95, slice(N_FAULTS, None))
    units = np.concatenate([np.ones(N_FAULTS), s])
    return NuisanceEstimate(
        *(nuisance.names, nuisance.units, nuisance.physical(x[N_FAULTS:]), sd),
        s[:, None] * covariance[N_FAULTS:] * units,
        nuisance.physical(np.clip(limits.T, low, high)).T,
    )


class Rival(NamedTuple):
    """Another explanation of a cycle: x = [k; ν] and its standard deviation, shape (6 + m,)."""

    x: np.ndarray
    sd: np.ndarray


class Edges:
    """How far each element of x may go while all others make up for it within bounds: the profile of the least squares.

    Where an effect looks like faults, the truth (an effect alone) lies at the edge that the faults' bounds cut out of
    the distribution, where its marginals have next to no weight. The profile reaches to the edge and as far beyond as
    the noise does. Other explanations that fit, `rivals`, are within too.

    An element at its true value may push others to their bounds that are free where the fit is best. Noise then has
    had their directions, too, to make the best fit better: the rise of the sum of squares is χ² with one degree of
    freedom more for each element newly at a bound (chi-bar-squared [1]_, given the face).

    References
    ----------
    .. [1] Shapiro, "Towards a unified theory of inequality constrained testing", Int. Stat. Rev. 56 (1988) 49.
    """

    def __init__(
        self,
        A: np.ndarray,
        b: np.ndarray,
        x: np.ndarray,
        bounds: tuple[np.ndarray, np.ndarray],
        rivals: Sequence[Rival],
    ):
        self._A, self._b, self._x, self._bounds, self._rivals = A, b, x, bounds, rivals
        self._cost = float(np.sum((b - A @ x) ** 2))
        self._n_pinned = int(np.sum((x <= bounds[0]) | (x >= bounds[1])))

    def widened(self, limits: np.ndarray, level: float, part: slice) -> np.ndarray:
        """Limits (n, 2) of the elements `part`, so far that they hold what the profile allows at this level."""
        allowed = chdtri(1.0 + np.arange(1 + len(self._x)), 1.0 - level)  # by number newly at a bound
        half = ndtri(0.5 + 0.5 * level)
        for rival in self._rivals:
            low, high = (rival.x + side * half * rival.sd for side in (-1.0, 1.0))
            limits = np.column_stack([np.minimum(limits[:, 0], low[part]), np.maximum(limits[:, 1], high[part])])
        limits = np.clip(limits, *(side[part][:, None] for side in self._bounds))
        reached = [
            [self._reach(j, float(end), allowed, bound) for end, bound in zip(ends, bounds, strict=True)]
            for j, ends, *bounds in zip(
                range(*part.indices(len(self._x))), limits, *(side[part] for side in self._bounds), strict=True
            )
        ]
        return np.array(reached)

    def _reach(self, j: int, end: float, allowed: np.ndarray, bound: float) -> float:
        """From the limit `end` outwards, up to `bound`: where the cost has risen by as much as is allowed."""

        def beyond(value: float) -> float:
            return self._risen(j, value, allowed) - 1.0

        if beyond(end) > 0.0:
            return end
        if beyond(bound) <= 0.0:
            return bound
        return float(brentq(beyond, end, bound, xtol=RESOLUTION))

    def _risen(self, j: int, value: float, allowed: np.ndarray) -> float:
        """How far the standard deviation allowed is used up when element `j` has this value; 1 at the edge."""
        low, high = self._bounds
        others = np.arange(len(self._x)) != j
        b = self._b - self._A[:, j] * value
        best = bounded_least_squares(self._A[:, others], b, low[others], high[others]).x
        rise = max(float(np.sum((b - self._A[:, others] @ best) ** 2)) - self._cost, 0.0)
        n_pinned = int(np.sum((best <= low[others]) | (best >= high[others])))
        return float(np.sqrt(rise / allowed[max(n_pinned - self._n_pinned, 0)]))


def rivals(nuisance: Nuisance, A: np.ndarray, b: np.ndarray, x: np.ndarray, covariance: np.ndarray) -> list[Rival]:
    """Explanations in which faults and nuisance are confused and that fit this cycle as well.

    For each nuisance parameter the least squares is solved again with that parameter at its prior's centre (faults
    stand for it), and with the faults it can be mistaken for at zero (it stands for them). An explanation that fits as
    well and differs in a fault is a rival.

    Parameters
    ----------
    A, b : arrays, shape (n, 6 + m), (n,)
        Whitened problem ‖b - A x‖² with the prior's rows.
    x : array, shape (6 + m,)
        Its solution within bounds.
    """
    cost = float(np.sum((b - A @ x) ** 2))
    sd = np.sqrt(np.diag(covariance))
    found = []
    for j in range(N_FAULTS, N_FAULTS + len(nuisance)):
        alike = np.abs(covariance[j, :N_FAULTS]) > MIMICRY * sd[j] * sd[:N_FAULTS]
        for fixed in (np.array([j]), np.flatnonzero(alike)):
            if not fixed.size:
                continue
            free = np.setdiff1d(np.arange(len(x)), fixed)
            low, high = (side[free] for side in nuisance.bounds)
            solution = bounded_least_squares(A[:, free], b, low, high)
            other, own_sd = np.zeros_like(x), np.zeros_like(x)
            other[free], own_sd[free] = solution.x, np.sqrt(np.diag(solution.covariance))
            worse = float(np.sum((b - A @ other) ** 2)) - cost
            if worse < RULED_OUT and np.abs(other - x)[:N_FAULTS].max() > MATTERS:
                found.append(Rival(other, own_sd))
    return found


NONE = Nuisance()
