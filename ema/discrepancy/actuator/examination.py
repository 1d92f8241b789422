"""What an examination of an actuator has found."""

from __future__ import annotations

from dataclasses import dataclass

from ema.discrepancy.findings import Findings

from .model import Model
from .noise import Verdict
from .search import Search


@dataclass(frozen=True)
class Examination:
    """The answer with what the report draws."""

    findings: Findings
    search: Search
    before: Model
    after: Model
    verdict_before: Verdict
    verdict_after: Verdict
