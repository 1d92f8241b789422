"""What HTML pages have in common: one style, and tables that scroll in themselves instead of widening the page."""

from __future__ import annotations

import re
from importlib.resources import files
from itertools import count

_TABLE = re.compile(r"<table\b.*?</table>", re.S)


def style() -> str:
    """The style sheet, to be put between <style> tags."""
    return files(__package__).joinpath("page.css").read_text(encoding="utf-8")


def with_scrolling_tables(html: str) -> str:
    """Each table in a frame of its own, which a keyboard can reach and scroll; tables are not nested."""
    number = count(1)

    def framed(match: re.Match[str]) -> str:
        label = f"table {next(number)}"
        return f'<div class="scroll" role="group" tabindex="0" aria-label="{label}">{match.group()}</div>'

    return _TABLE.sub(framed, html)
