"""The gain over folds: every part of the record is foretold once by parameters that the others gave."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ema.core.records import Array

ALONE = 10.0  # deviations that other parts have among themselves, by which a part stands out
TWICE = 2.0  # times the noise that it leaves at least


@dataclass(frozen=True)
class Folds:
    """What each part left out shows, as mean squares; parts weigh as `weight` says.

    Attributes
    ----------
    names : tuple of str, length n
        What was left out.
    before, after, floor : tuple of float, length n
        Mean square error before and after the effects were added, and what noise makes of it.
    weight : tuple of float, length n
    """

    names: tuple[str, ...]
    before: tuple[float, ...]
    after: tuple[float, ...]
    floor: tuple[float, ...]
    weight: tuple[float, ...]

    @property
    def err_before(self) -> float:
        """Root mean square error before, of all parts."""
        return _rms(np.array(self.before), self._weights)

    @property
    def err_after(self) -> float:
        """Root mean square error after."""
        return _rms(np.array(self.after), self._weights)

    @property
    def noise_floor(self) -> float:
        """What noise makes of `err_after`."""
        return _rms(np.array(self.floor), self._weights)

    @property
    def gain(self) -> float:
        """By how much the error fell."""
        return self.err_before - self.err_after

    @property
    def gain_error(self) -> float:
        """Standard error of `gain`: how much it depends on which parts the record happens to have."""
        before, after = np.array(self.before), np.array(self.after)
        return self._jackknife(lambda w: _rms(before, w) - _rms(after, w))

    @property
    def rest(self) -> float:
        """Error after over what noise makes of it; 1 is noise."""
        return self.err_after / max(self.noise_floor, 1e-300)

    @property
    def rest_error(self) -> float:
        """Standard error of `rest`."""
        after, floor = np.array(self.after), np.array(self.floor)
        return self._jackknife(lambda w: _rms(after, w) / max(_rms(floor, w), 1e-300))

    @property
    def relative_rest_error(self) -> float:
        """Standard error of the logarithm of `rest`: a ratio is skewed, and parts that differ widely are no chance."""
        after, floor = np.array(self.after), np.array(self.floor)
        return self._jackknife(lambda w: float(np.log(max(_rms(after, w), 1e-300) / max(_rms(floor, w), 1e-300))))

    def least_rest(self, deviations: float) -> float:
        """`rest` less so many standard errors of its logarithm; of one part itself."""
        scatter = self.relative_rest_error if len(self.names) > 1 else 0.0
        return self.rest * float(np.exp(-deviations * scatter))

    @property
    def event(self) -> tuple[str, float, float] | None:
        """The one part that leaves far more than all others, with what it and the most of these leave; else None.

        What happens once makes a mean over parts scatter, and so looks like chance.
        """
        rests = np.sqrt(np.array(self.after) / np.maximum(self.floor, 1e-300))
        k = int(np.argmax(rests))
        others = np.delete(rests, k)
        if len(others) < 3 or rests[k] < max(TWICE, others.mean() + ALONE * others.std(ddof=1)):
            return None
        return self.names[k], float(rests[k]), float(others.max())

    @property
    def told_rest(self) -> str:
        """`rest` with its error, in words."""
        return f"{self.rest:.3g} ± {self.rest_error:.2g}" if len(self.names) > 1 else f"{self.rest:.3g}"

    @property
    def _weights(self) -> Array:
        return np.array(self.weight, dtype=float)

    def _jackknife(self, statistic: Callable[[Array], float]) -> float:
        """Standard error by leaving out each part once [Efron and Stein, Ann. Stat. 9, 1981]; infinite for one part."""
        n = len(self.names)
        if n < 2:
            return float("inf")
        without = [statistic(np.where(np.arange(n) == j, 0.0, self._weights)) for j in range(n)]
        return float(np.sqrt((n - 1) * np.var(without)))

    def rows(self) -> list[tuple[str, float, float, float]]:
        """What was left out, with its error before and after, and what noise makes of it."""
        each = zip(self.names, self.before, self.after, self.floor, strict=True)
        return [(name, b**0.5, a**0.5, f**0.5) for name, b, a, f in each]

    def sentence(self, scale: float, unit: str) -> str:
        """The gain with its error, in words."""
        numbers = (self.err_before, self.err_after, abs(self.gain), self.gain_error)
        before, after, gain, error = (_short(scale * x) for x in numbers)
        how = "falls" if self.gain >= 0.0 else "grows"
        return (
            f"Held out one by one, the error of {len(self.names)} parts {how} from {before} to {after} {unit}, "
            f"by {gain} ± {error}; what is left is {self.told_rest} times what noise makes of it."
        )

    def as_dict(self) -> dict[str, Any]:
        """For findings.json."""
        return {
            "n": len(self.names),
            "err_before": self.err_before,
            "err_after": self.err_after,
            "noise_floor": self.noise_floor,
            "gain": self.gain,
            "gain_error": _finite(self.gain_error),
            "rest": self.rest,
            "rest_error": _finite(self.rest_error),
            "parts": [
                {"left_out": name, "err_before": before, "err_after": after, "noise_floor": floor}
                for name, before, after, floor in self.rows()
            ],
        }


def _short(x: float) -> str:
    """Three digits, without a power of ten."""
    return f"{x:.3g}" if x < 999.5 or not np.isfinite(x) else f"{x:.0f}"


def _finite(x: float) -> float | None:
    return x if np.isfinite(x) else None


def _rms(squares: Array, weight: Array) -> float:
    return float(np.sqrt(squares @ weight / weight.sum()))


def deal(order: Sequence[int], n_at_most: int) -> list[list[int]]:
    """Parts in at most so many groups, dealt like cards, so that neighbours come into different ones."""
    n = min(n_at_most, len(order))
    return [list(order[first::n]) for first in range(n)]
