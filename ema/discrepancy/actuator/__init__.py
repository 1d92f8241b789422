"""The three-phase actuator: what its simulation gets wrong, from measured cycles.

`cycles` checks and groups the records; `features` reduces a cycle to balances that feel physics; `plant` simulates
the cycles at any point of faults and effects; `noise` says what two runs differ by, and whether a residual is more;
`fit` is Gauss–Newton on simulated means; `weak` and `candidates` say what to try, `select` tries it, `structure`
describes what is left, `examine` is the whole run, `pictures` shows it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from ema.core import config
from ema.core.records import Record
from ema.discrepancy.findings import Findings
from ema.discrepancy.report import Picture
from ema.models.actuator import Actuator


def discrepancy(
    plant_file: Path, records: Sequence[Record], say: Callable[[str], None]
) -> tuple[Findings, Callable[[], list[Picture]]]:
    """Findings on records of the actuator in `plant_file`, and what draws their pictures."""
    from .cycles import measured
    from .examine import examine
    from .pictures import pictures

    plant = config.load(plant_file, Actuator)
    examination = examine(plant, measured(plant, records), say=say)
    return examination.findings, lambda: pictures(examination)
