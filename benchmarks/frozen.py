"""Trials of one commit: seeds that nobody can have developed on, and a file that holds one commit only."""

from __future__ import annotations

import hashlib
import subprocess
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]


class MixedCommitsError(Exception):
    """Rows of several commits, or of a changed working tree, are not one experiment."""


def commit() -> str:
    """The commit under test, with ``+`` behind it where tracked files differ from it."""
    head = _git("rev-parse", "HEAD")
    return head + ("+" if _git("status", "--porcelain", "--untracked-files=no") else "")


def seed(commit: str, stratum: str, trial: int) -> int:
    """Seed of a trial: anybody can repeat it, and nobody knew it before the commit was made."""
    digest = hashlib.sha256(f"{commit} {stratum} {trial}".encode()).digest()
    return int.from_bytes(digest[:4], "big")


def of_one_commit(rows: Iterable[Mapping[str, Any]]) -> str:
    """The commit of all rows; MixedCommitsError where there is none."""
    commits = sorted({str(row.get("commit")) for row in rows})
    if len(commits) != 1:
        raise MixedCommitsError(f"rows of {len(commits)} commits ({', '.join(c[:9] for c in commits)}): must be of one")
    if commits[0].endswith("+") or commits[0] == "None":
        raise MixedCommitsError(f"rows of {commits[0]}: a changed working tree cannot be repeated; commit first")
    return commits[0]


def _git(*words: str) -> str:
    return subprocess.run(["git", *words], cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()
