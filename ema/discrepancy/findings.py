"""What `ema discrepancy` says: one form for every plant, written as findings.json."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ema.core.names import FAULT_MEANING, FAULTS
from ema.core.version import version
from ema.effects import registry

from .folds import Folds
from .grade import UPPER, Verdict


@dataclass(frozen=True)
class Quantity:
    """A value with its interval of 95 %."""

    value: float
    low: float
    high: float
    unit: str

    def __str__(self) -> str:
        interval = f" ({self.low:.3g} … {self.high:.3g})" if self.high > self.low else ""
        return f"{self.value:.3g}{interval}" + (f" {self.unit}" if self.unit != "1" else "")

    @property
    def sd(self) -> float:
        """Standard deviation, by the side of the interval that no bound cuts off."""
        return max(self.high - self.value, self.value - self.low) / WITHIN


@dataclass(frozen=True)
class FoundEffect:
    """A cause with what the data cannot tell from it, and the experiment that could.

    `place` says where it acts: in the plant, in the control loop, or in the recorder alone. What is not
    `in_every_record` is no part of the extended model. `of_others` is the probability that it is one of what the data
    cannot tell from it, where that was weighed.
    """

    name: str
    confidence: float
    indistinguishable_from: tuple[str, ...]
    parameters: dict[str, Quantity]
    sentence: str
    separated_by: str
    place: Literal["plant", "loop", "recorder"] = "plant"
    in_every_record: bool = True
    of_others: float | None = None

    @property
    def z(self) -> float | None:
        """Deviations by which its size differs from nothing, the largest of its sizes (a gain of each phase, say).

        Sizes are parameters of the kind of the first; None where no interval was told.
        """
        declared = registry()[self.name].parameters if self.name in registry() else ()
        sizes = {p.name: p.neutral for p in declared if (p.unit, p.neutral) == (declared[0].unit, declared[0].neutral)}
        told = [(q, sizes[name]) for name, q in self.parameters.items() if name in sizes and q.sd > 0.0]
        return max((abs(q.value - neutral) / q.sd for q, neutral in told), default=None)

    @property
    def numbers(self) -> str:
        """Confidence and parameters with their intervals, to be read behind the sentence."""
        of = ", ".join(f"{name} {q}" for name, q in self.parameters.items())
        return f" [P {self.of_set:.2f}{' for the set' if self.indistinguishable_from else ''}{'; ' if of else ''}{of}]"

    @property
    def of_set(self) -> float:
        """Confidence that it is this one or one of those that it cannot be told from, which share what is sure."""
        if self.of_others is not None:
            return min(1.0, self.confidence + self.of_others)
        return min(1.0, self.confidence * (1 + len(self.indistinguishable_from)))


@dataclass(frozen=True)
class Gain:
    """Errors of the simulated envelope [A] and faults before and after the effects were added."""

    train_before: float
    train_after: float
    heldout_before: float
    heldout_after: float
    noise_floor: float
    k_before: tuple[float, ...] = ()
    k_after: tuple[float, ...] = ()
    false_alarms_before: int = 0
    false_alarms_after: int = 0
    k_interval: tuple[tuple[float, float], ...] = ()  # of 95 %, of k_after
    k_names: tuple[str, ...] = ()  # where they are not the faults k1…k6
    what: str = "error of the simulated envelope"
    scale: float = 1e3
    unit: str = "mA"
    folds: Folds | None = None  # what the held-out errors are made of, where every part was held out once
    residual: Folds | None = None  # the same of the residual weighed by its noise, in its deviations

    @property
    def no_cause(self) -> str:
        """What explains a record without any effect: faults, of an actuator."""
        return "none of the library" if self.k_names else "faults alone"

    @property
    def told_faults(self) -> str:
        """The actuator's faults with their intervals, and how large any other may be; empty of another plant."""
        if self.k_names or not self.k_interval:
            return ""
        named = list(zip(FAULTS, self.k_after, self.k_interval, strict=True))
        there = [
            f"{k} ({FAULT_MEANING[k]}) {x:.3g} ({low:.3g} … {high:.3g})" for k, x, (low, high) in named if low > 0.0
        ]
        most = max((high for _, _, (low, high) in named if low <= 0.0), default=None)
        others = [f"{'no other' if there else 'none'} above {most:.2g}"] if most is not None else []
        return f"Faults: {'; '.join([', '.join(there)] * bool(there) + others)}."

    @property
    def rest(self) -> float:
        """What is left of held-out parts over what noise makes of it, of error or residual whichever is more."""
        return max(self._rest_of_error, self.residual.rest if self.residual else 0.0)

    @property
    def told_rest(self) -> str:
        """The same in words, of which of the two it is."""
        is_error = self.rest == self._rest_of_error
        what = "the error of free runs" if is_error else "the residual weighed by its noise"
        times = self.folds.told_rest if is_error and self.folds else f"{self.rest:.3g}"
        return f"{times} times what noise makes is left, of {what}"

    @property
    def is_rest_sure(self) -> bool:
        """Whether more than noise is left by more than parts scatter."""
        if self.folds is None or self.rest > self._rest_of_error:
            return True
        return self.folds.least_rest(UPPER) > 1.0

    @property
    def _rest_of_error(self) -> float:
        return self.heldout_after / max(self.noise_floor, 1e-300)


@dataclass(frozen=True)
class Findings:
    """The answer.

    Attributes
    ----------
    notes : list of str
        What a reader must know to judge the answer: what was not measured, what was close.
    records : list of dict
        Held-out errors by record, where records differ in kind.
    fitted : dict
        Values that replace those of the plant file beside the effects.
    unnamed : list of FoundEffect
        Structure that is written into the extended plant without being a cause.
    rest : float
        What is left over noise, where that is told and it is more than noise; else 0.
    rejected : list of dict
        What was considered and is not the answer: its ``name``, what faults alone (``before``) and what it (``after``)
        leaves of held-out parts over noise, by how many ``nats`` it is less likely than the answer (None where that
        is not known) with the ``nats_error``, what was weighed (``nats_of``: the evidence of the record, or held-out
        parts), and ``why`` in words.
    posterior : list of dict
        Sets of causes with their probability, likeliest first: ``effects``, ``faults`` above 1 %, ``probability``,
        ``nats_behind`` the likeliest and ``nats_error``, what other seeds would make of that. Of the sets that were
        fitted only; empty where none was weighed.
    next_recording : dict
        Motions that would tell the answer from what it is not told from: the two sets (``between``), how many
        ``cycles``, and of each of the ``motions`` the standard ``deviations`` by which simulation has the sets apart,
        with a ``sentence``. Empty where nothing is left to be told apart.
    seeds : dict
        Of the simulations that the answer rests on, where there are any.
    balance : dict
        What a regression of the balance of torque along the measured motion explains, where the plant has one.
    moved : dict
        What was fitted away from the plant file though it is no effect: ``said``, in words, and the effects that would
        look the same on these records (``alike``). Empty where nothing was.
    leading : list of dict
        Of a search that was interrupted the sets that led: ``effects``, what they leave of held-out parts over noise
        (``left``), ``parameters``, and what was ``fitted`` beside them.
    """

    verdict: Verdict
    effects: list[FoundEffect]
    gain: Gain
    structure: dict[str, Any] = field(default_factory=dict)
    tried: list[dict[str, Any]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    records: list[dict[str, Any]] = field(default_factory=list)
    fitted: dict[str, Any] = field(default_factory=dict)
    unnamed: list[FoundEffect] = field(default_factory=list)
    rest: float = 0.0
    rejected: list[dict[str, Any]] = field(default_factory=list)
    posterior: list[dict[str, Any]] = field(default_factory=list)
    next_recording: dict[str, Any] = field(default_factory=dict)
    seeds: dict[str, int] = field(default_factory=dict)
    balance: dict[str, Any] = field(default_factory=dict)
    moved: dict[str, Any] = field(default_factory=dict)
    leading: list[dict[str, Any]] = field(default_factory=list)

    def as_dict(self) -> dict[str, Any]:
        """The content of findings.json."""
        g = self.gain
        known = _known if self.verdict == "unfinished" else float
        return {
            "verdict": self.verdict,
            **({"unfinished": True, "leading": self.leading} if self.verdict == "unfinished" else {}),
            "effects": [{**asdict(effect), "of_set": effect.of_set, "z": effect.z} for effect in self.effects],
            "structure": self.structure,
            "gain": {
                "train": {"err_before": known(g.train_before), "err_after": known(g.train_after)},
                "heldout": {
                    "err_before": known(g.heldout_before),
                    "err_after": known(g.heldout_after),
                    "noise_floor": known(g.noise_floor),
                },
                **({"k_names": list(g.k_names)} if g.k_names else {}),
                "k_before": list(g.k_before),
                "k_after": list(g.k_after),
                **({"k_interval": [list(of) for of in g.k_interval]} if g.k_interval else {}),
                "false_alarms_before": g.false_alarms_before,
                "false_alarms_after": g.false_alarms_after,
                **({"folds": g.folds.as_dict()} if g.folds else {}),
                **({"residual": g.residual.as_dict()} if g.residual else {}),
            },
            **({"posterior": self.posterior} if self.posterior else {}),
            **({"next_recording": self.next_recording} if self.next_recording else {}),
            "rejected": self.rejected,
            "tried": self.tried,
            "notes": self.notes,
            **({"rest": self.rest} if self.rest else {}),
            **({"records": self.records} if self.records else {}),
            "version": version(),
            "seeds": self.seeds,
            **({"balance": self.balance} if self.balance else {}),
            **({"moved": self.moved} if self.moved else {}),
        }

    def write(self, path: Path) -> None:
        """Write findings.json."""
        path.write_text(json.dumps(self.as_dict(), indent=1, ensure_ascii=False) + "\n", encoding="utf-8")

    def sentences(self, *, numbers: bool = False) -> list[str]:
        """What an engineer would say; with `numbers` each cause's confidence and intervals too."""
        if self.verdict == "unfinished":
            return [_led(self.leading)]
        if self.verdict == "adequate":
            provided = f", where {self.moved['said']}" if self.moved else ""
            if not self.rest:
                agrees = f"The simulation agrees with the measurement{provided}: what is left is noise."
                return [agrees, *self._not_ruled_out()]
            left = f"What is left is small, {self.rest:.3g} times the noise, but it is not noise"
            if self.rest <= 1.0:
                left = "What is left is no larger than noise, but has a structure that noise has not"
            return [left + provided + ("; its structure: " + describe(self.structure) if self.structure else "") + "."]
        said = []
        told: set[str] = set()  # experiments: each is told in full once
        for effect in self.effects:
            said.append(_said(effect, again=effect.separated_by in told) + (effect.numbers if numbers else ""))
            told.add(effect.separated_by)
        if self.verdict == "explained" and self.rest > SEEN:
            said.append(
                f"What is left of the residual weighed by its noise is {self.rest:.3g} times the noise, not noise: "
                "a law has not quite the right form, or something smaller is missing."
            )
        if self.verdict == "partly explained":
            left = f"That is not all: {self.gain.told_rest} on held-out parts"
            if not self.gain.is_rest_sure:
                left = f"That may not be all: {self.gain.told_rest} on held-out parts, no more than these scatter"
            said.append(left + ("; its structure: " + describe(self.structure) if self.structure else "") + ".")
        if self.verdict == "unexplained":
            none = (
                "none that stands out"
                if not (self.balance.get("terms") or self.balance.get("given"))
                else "what the balance shows"
            )
            said.append(f"No effect of the library explains the rest; its structure: {describe(self.structure, none)}.")
        return said

    def _not_ruled_out(self) -> list[str]:
        """What may be there and is not needed, in a sentence, where anything is."""
        may = [s for s in self.posterior if s["effects"] and s["probability"] > NOT_RULED_OUT]
        told = ", ".join(f"{' + '.join(s['effects'])} ({s['probability']:.2f})" for s in may)
        return [f"Not needed for it, but not ruled out by these records: {told}."] if told else []


def reject(
    name: str,
    before: float,
    after: float,
    why: str,
    nats: tuple[float | None, float | None] = (None, None),
    of: str | None = None,
) -> dict[str, Any]:
    """What was considered and is not the answer (`Findings.rejected`); `nats` with their error, by what is `of`."""
    row = {"name": name, "before": before, "after": after, "nats": nats[0], "nats_error": nats[1], "nats_of": of}
    return {**row, "why": why}


SURE = 0.9
WITHIN = 1.96  # deviations from the value to either end of an interval of 95 %
NOT_RULED_OUT = 0.1  # probability from which what is not needed is worth a word
SEEN = 1.05  # times the noise, where a rest beside a cause is worth a word


def _said(effect: FoundEffect, again: bool = False) -> str:
    """The effect's sentence with its reservations; those in a set share what is sure of it.

    Where the experiment that tells has been told before (`again`), it is not told in full.
    """
    how = "likewise" if again else f"by {effect.separated_by}"
    others = effect.indistinguishable_from
    odds = effect.of_set
    text = effect.sentence[0].upper() + effect.sentence[1:]
    if others:
        text = f"One of {1 + len(others)} that fit alike, this record cannot tell which: {effect.sentence}"
    if odds < SURE:
        which = "one of these" if others else effect.sentence
        text = f"Perhaps, with a confidence of {odds:.0%} only: {which}"
        text += f", {effect.sentence}" if others else ""
    if others:
        text += f"; or {' or '.join(others)}, or some of each (told apart {how})"
    elif odds < SURE:
        text += f" (to be confirmed {how})"
    return text + "."


def _led(leading: list[dict[str, Any]]) -> str:
    """What led when a search was interrupted."""
    first, *others = leading
    text = f"Unfinished: nothing is decided yet. {_named(first)} led"
    return text + (f", before {', '.join(map(_named, others[:2]))}." if others else "; nothing else was fitted yet.")


def _named(tried: dict[str, Any]) -> str:
    return f"{' + '.join(tried['effects']) or 'no effect'} (leaves {tried['left']:.3g} times what noise makes)"


def _known(x: float) -> float | None:
    """What was measured; None where nothing was."""
    return float(x) if np.isfinite(x) else None


def describe(structure: dict[str, Any], none: str = "none that stands out") -> str:
    """The structure of an unexplained residual in words."""
    parts = [str(text) for text in structure.get("sentences", [])]
    return "; ".join(parts) if parts else none
