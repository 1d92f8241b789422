"""report.html: one file that opens without a network."""

from __future__ import annotations

import base64
import io
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import jinja2

from ema.core import pages
from ema.core.version import version

from .findings import Findings
from .grade import UNSOLVED

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Picture:
    """A figure as PNG with what it shows."""

    title: str
    caption: str
    png: bytes

    @property
    def uri(self) -> str:
        """For an <img>."""
        return "data:image/png;base64," + base64.b64encode(self.png).decode()


def picture(title: str, caption: str, figure: Figure) -> Picture:
    """Render a figure."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=110, bbox_inches="tight")
    return Picture(title, caption, stream.getvalue())


def write_report(
    path: Path, plant_name: str, records: Sequence[str], findings: Findings, pictures: Sequence[Picture]
) -> None:
    """Write the report, in place of an earlier one at `path`; interrupted, the earlier one stays whole."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("ema.discrepancy", "."), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    html = environment.get_template("report.html.j2").render(
        plant=plant_name,
        records=records,
        f=findings,
        g=findings.gain,
        sentences=findings.sentences(),
        alike=_alike(findings),
        is_unsolved=findings.verdict in UNSOLVED,
        pictures=pictures,
        software=version(),
        css=pages.style(),
    )
    unfinished = path.with_name(f".{path.name}")
    try:
        unfinished.write_text(pages.with_scrolling_tables(html), encoding="utf-8")
        os.replace(unfinished, path)
    finally:
        unfinished.unlink(missing_ok=True)


def _alike(findings: Findings) -> str:
    """What the headline adds where a cause is one of several that fit alike."""
    sets = [bool(effect.indistinguishable_from) for effect in findings.effects]
    if not any(sets) or findings.verdict == "unexplained":
        return ""
    return ", by one of several that fit alike" if all(sets) else ", some of it by one of several that fit alike"
