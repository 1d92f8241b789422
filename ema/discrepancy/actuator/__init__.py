"""The three-phase actuator: what its simulation gets wrong, from measured cycles.

`cycles` checks and groups the records (`measured`); `features` reduces a cycle to balances that feel physics; `plant`
simulates the cycles at any point of faults and effects, each run once (`runs`); `noise` says what two runs differ by,
and whether a residual is more; `fit` is Gauss–Newton on simulated means, and a `search` keeps each fitted `model`.
`weak` and `candidates` say what to try, `screening` what it promises and what would do the same; `structure`,
`controller` and `repeating` describe what is left, `examine` is the whole run, `pictures` shows it. Of the run, `paths`
are its ways, `forward` fits the best of them, `weighing` says whether one is real, `verdicts` makes sure, `simpler`
prefers fewer causes, such as one instead of several faults, `telling` puts the model into findings. Before it `checks`
refuses, `conditions`, `comparators`, `timing`, `sampling`, `play` and `zeros` read what is no flaw of the actuator,
`growing` whether its faults change.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from ema.core.records import Record
from ema.discrepancy.findings import Findings
from ema.discrepancy.progress import Progress
from ema.discrepancy.report import Picture
from ema.identification.alignment import aligned
from ema.models import actuator_file


def discrepancy(
    plant_file: Path, records: Sequence[Record], say: Progress
) -> tuple[Findings, Callable[[], list[Picture]]]:
    """Findings on records of the actuator in `plant_file`, and what draws their pictures."""
    from .cycles import measured
    from .examine import examine
    from .pictures import pictures

    plant = actuator_file.load(plant_file)
    read = [aligned(record, plant) for record in records]
    notes = [note for _, own in read for note in own]
    for note in notes:
        say(note)
    records = [record for record, _ in read]
    examination = examine(plant, measured(plant, records), say=say)
    findings = examination.findings
    return replace(findings, notes=[*notes, *findings.notes]), lambda: pictures(examination)
