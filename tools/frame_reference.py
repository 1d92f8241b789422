"""Write docs/frames.md from dbc/ema.dbc: `python tools/frame_reference.py`. A test says when it is out of date."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cantools

from ema.bus import identifiers
from ema.core import resources

PAGE = Path(__file__).resolve().parents[1] / "docs" / "frames.md"


def page() -> str:
    """The whole page."""
    database: Any = cantools.database.load_file(resources.dbc())
    return "\n".join(_lines(database)) + "\n"


def _lines(database: Any) -> Iterator[str]:
    yield "# Frames on the bus"
    yield ""
    yield "Written by `tools/frame_reference.py` from `dbc/ema.dbc`: change that file, not this one."
    yield ""
    yield database.buses[0].comment
    yield ""
    yield "## Identifiers"
    yield ""
    yield from _identifier_table()
    yield ""
    yield "| message | id | LCC | FID | message code | from | bytes | every | missed after |"
    yield "|---|---|---|---|---|---|---|---|---|"
    for message in database.messages:
        fields = identifiers.parse(message.frame_id)
        timeout = message.dbc.attributes.get("TimeoutMs")
        every = f"{message.cycle_time} ms" if message.cycle_time else ""
        missed = f"{timeout.value} ms" if timeout else ""
        code = fields.doc // identifiers.N_ACTUATORS
        yield (
            f"| [{message.name}](#{message.name.lower()}) | `{message.frame_id:08X}` | {fields.lcc} | {fields.fid} "
            f"| {code} | {message.senders[0]} | {message.length} | {every} | {missed} |"
        )
    for message in database.messages:
        yield from _message(message)


def _identifier_table() -> Iterator[str]:
    """The table of the identifiers' own module, so that it exists once."""
    rows = [row for row in (identifiers.__doc__ or "").splitlines() if row[:1].isalnum() and "  " in row]
    for n, row in enumerate(rows):
        yield "| " + " | ".join(part.strip() for part in row.split("  ") if part.strip()) + " |"
        if n == 0:
            yield "|---|---|---|"


def _message(message: Any) -> Iterator[str]:
    yield ""
    yield f"## {message.name}"
    yield ""
    yield message.comment
    yield ""
    yield "| signal | byte | type | step | range | unit | meaning |"
    yield "|---|---|---|---|---|---|---|"
    for signal in message.signals:
        first = signal.start // 8
        order = "little-endian " if signal.byte_order == "little_endian" and signal.length > 8 else ""
        kind = f"{order}{'float' if signal.is_float else 'int' if signal.is_signed else 'uint'}{signal.length}"
        meaning = signal.comment.removesuffix(f" [{signal.unit}]") if signal.unit else signal.comment
        if signal.choices:
            meaning += " " + ", ".join(f"{value} {name}" for value, name in signal.choices.items()) + "."
        span = f"{_number(signal.minimum)} … {_number(signal.maximum)}"
        cells = (signal.name, first, kind, _number(signal.scale), span, signal.unit or "", meaning)
        yield "| " + " | ".join(map(str, cells)) + " |"


def _number(value: float) -> str:
    return f"{value:.10g}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE)
