"""What a search tells while it goes on, and what is known if it is ended before its end."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from .findings import Findings, Gain
from .plant import Point

N_LEADING = 5  # sets that an unfinished answer shows
NOT_DONE = (
    "interrupted before the end: nothing was judged, no gain was measured, and no extended.yaml was written; "
    "what leads may be overtaken"
)


@dataclass(frozen=True)
class Fitted:
    """A set of effects that was fitted: what it leaves of held-out parts (1 is noise), and its parameters."""

    names: tuple[str, ...]
    left: float
    values: Point
    by: object

    @property
    def said(self) -> str:
        """The names, for a line of text."""
        return " + ".join(self.names) or "no effect"


class Progress:
    """Passes texts on, and remembers what was fitted.

    Parameters
    ----------
    say : callable
        Takes one line of text.
    pass_by : callable, optional
        The same for what is only tried, or does not lead: what is worth a look and no line. Like `say` if not given.
    """

    def __init__(self, say: Callable[[str], None] = lambda text: None, pass_by: Callable[[str], None] | None = None):
        self.say, self.pass_by = say, pass_by or say
        self.tried: list[Fitted] = []
        self._begun = time.monotonic()

    def __call__(self, text: str) -> None:
        """Tell what is being done."""
        self.say(text)

    def fitted(self, names: Sequence[str], left: float, values: Point, by: object = None) -> None:
        """Tell what a set of effects leaves, and which set leads.

        `by` is what it was weighed by: what was weighed by one noise is not compared with what was by another.
        """
        self.tried.append(Fitted(tuple(names), left, dict(values), by))
        last, (first, *_) = self.tried[-1], self.leading()
        lead = "" if first is last else f"; leading: {first.said}, {first.left:.3g}"
        tell = self.say if first is last else self.pass_by
        tell(f"{last.said}: leaves {left:.3g} of held-out parts{lead}")

    def leading(self) -> list[Fitted]:
        """The best fit of each set of effects, by what the last one was weighed by, best first."""
        best: dict[tuple[str, ...], Fitted] = {}
        for t in self.tried:
            if t.by is self.tried[-1].by:
                key = tuple(sorted(t.names))
                best[key] = min(t, best.get(key, t), key=lambda x: x.left)
        return sorted(best.values(), key=lambda t: t.left)

    def unfinished(self) -> Findings:
        """What is known, marked as unfinished; nothing is named and nothing is claimed."""
        leading = [
            {
                "effects": list(t.names),
                "left": t.left,
                "parameters": {name: x for name, x in t.values.items() if name.split(".")[0] in t.names},
                "fitted": {name: x for name, x in t.values.items() if "." not in name},
            }
            for t in self.leading()[:N_LEADING]
        ]
        unknown = Gain(math.nan, math.nan, math.nan, math.nan, math.nan)
        tried = [{"name": t.said, "score": -t.left} for t in self.leading()]
        after = f"ended after {time.monotonic() - self._begun:.0f} s and {len(self.tried)} fits"
        return Findings("unfinished", [], unknown, tried=tried, notes=[NOT_DONE, after], leading=leading)
