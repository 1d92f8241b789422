"""`ema replay --identify`: what it prints and writes."""

from __future__ import annotations

import csv
import json
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click

from ema.core.errors import LogError, NegativeAnswer
from ema.core.names import FAULTS
from ema.core.version import version
from ema.log import LogReader, Message
from ema.log.schemas import ALARM, ESTIMATE
from ema.log.segment import Segment

from .alarms_again import AlarmComparison
from .compare import Comparison, Pair, Totals
from .identify import Setup, identified, setup
from .integrity import conclude
from .open_log import names
from .received import Log

_COMMIT_EVERY = 1000  # messages
_ALARMS = ("changes of alarms equal to the log's", "only in the log", "only now")


def run(
    log: Log,
    given: tuple[str, ...],
    channels: tuple[str, ...],
    cycles: Path | None,
    out: Path | None,
    n_processes: int | None,
    as_json: bool,
) -> None:
    """Identify, compare, print. NegativeAnswer when the bundle is the log's own and an estimate differs."""
    how = setup(log, given)
    started = time.monotonic()
    with ExitStack() as opened:
        table = _CycleTable(cycles, opened) if cycles else None
        comparison = Comparison(table.write if table else lambda pair: None)
        target = _Target(out, log, how, opened) if out else None
        alarms = AlarmComparison()
        for item in identified(log, how, channels, n_processes):
            if isinstance(item, Message):
                (alarms if item.topic == ALARM.topic else comparison).logged(item.content)
                continue
            if target:
                target.add(item)
            if item.kind is ESTIMATE:
                comparison.again(json.loads(item.data))
            elif item.kind is ALARM:
                alarms.again(json.loads(item.data))
        comparison.finish()
    seconds = time.monotonic() - started
    if not comparison.totals:
        raise LogError(f"{names(log.paths)}: no cycle of a monitored actuator in it")
    if as_json:
        click.echo(json.dumps(_answer(comparison, how) | {"alarms": alarms.counts}, indent=2))
    else:
        click.echo(_text(comparison, how, seconds))
        click.echo(", ".join(f"{n} {words}" for n, words in zip(alarms.counts.values(), _ALARMS, strict=True)))
    if how.same and not comparison.n_different and alarms.n_different:
        raise NegativeAnswer(
            f"{alarms.n_different} changes of alarms have no equal in the log, though the bundle is the same"
        )
    if how.same and comparison.n_different:
        largest = max(float(t.largest.max()) for t in comparison.totals.values())
        made_by = log.metadata().get("software", "an unknown version") if isinstance(log, LogReader) else ""
        raise NegativeAnswer(
            f"{comparison.n_different} estimates differ from the log's by up to {largest:.2g} in k, though the bundle "
            f"is the same (log made by {made_by}, identified by {version()})"
        )
    conclude(log)


class _CycleTable:
    """CSV with a row for each cycle and method."""

    def __init__(self, path: Path, opened: ExitStack):
        try:
            file = opened.enter_context(path.open("x", newline="", encoding="utf-8"))
        except FileExistsError as error:
            raise LogError(f"{path}: exists, and is not overwritten") from error
        except OSError as error:
            raise LogError(f"{path}: cannot be written ({error.strerror})") from error
        self._writer = csv.writer(file)
        sides = [f"{k}_{side} [1]" for side in ("logged", "again") for k in FAULTS]
        self._writer.writerow(
            ["t_ns [ns]", "actuator", "method", "cycle", "equal", "status_logged", "status_again", *sides]
        )

    def write(self, pair: Pair) -> None:
        sides: list[dict[str, Any]] = [side or {"k": [None] * len(FAULTS)} for side in (pair.logged, pair.again)]
        who = [pair.actuator, pair.method, pair.cycle, int(pair.equal)]
        t_ns = next(side["t_ns"] for side in sides if "t_ns" in side)
        self._writer.writerow([t_ns, *who, *(side.get("status") for side in sides), *sides[0]["k"], *sides[1]["k"]])


class _Target:
    """A new log of the answers."""

    def __init__(self, path: Path, log: Log, how: Setup, opened: ExitStack):
        attached = log.attachments() if isinstance(log, LogReader) else {}
        manifests = {f"manifest-{n}.json": json.dumps(b.manifest).encode() for n, b in how.bundles.items()}
        kept = {name: data for name, data in attached.items() if not name.startswith("manifest")}
        metadata = {"identified_again_from": ", ".join(path.name for path in log.paths)}
        try:
            self._segment = Segment(path, time.time_ns(), kept | manifests, metadata)
        except FileExistsError as error:
            raise LogError(f"{path}: exists, and is not overwritten") from error
        except OSError as error:
            raise LogError(f"{path}: cannot be written ({error.strerror})") from error
        self._count = 0
        opened.callback(self._segment.finish)

    def add(self, message: Any) -> None:
        self._segment.add(message)
        self._count += 1
        if self._count % _COMMIT_EVERY == 0:
            self._segment.commit()


def _answer(comparison: Comparison, how: Setup) -> dict[str, Any]:
    return {
        "same_bundle": how.same,
        "n_equal": comparison.n_equal,
        "n_different": comparison.n_different,
        "methods": [
            {
                "actuator": actuator,
                "method": method,
                "n_pairs": t.n_pairs,
                "n_equal": t.n_equal,
                "n_only_logged": t.n_only_logged,
                "n_only_again": t.n_only_again,
                "n_status_changed": t.n_status,
                "rms": t.rms.tolist(),
                "largest": t.largest.tolist(),
            }
            for (actuator, method), t in sorted(comparison.totals.items())
        ],
    }


def _text(comparison: Comparison, how: Setup, seconds: float) -> str:
    first = max(t.n_pairs + t.n_only_again for t in comparison.totals.values())
    lines = [f"bundle: {'the one the log was made with' if how.same else 'another one than the log was made with'}"]
    lines.append(
        f"{'actuator':>8} {'method':<7} {'both':>6} {'equal':>6} {'only log':>8} {'only now':>8} {'status≠':>7}"
        + "".join(f" {'rms Δ' + k:>9}" for k in FAULTS)
    )
    lines += [_line(actuator, method, t) for (actuator, method), t in sorted(comparison.totals.items())]
    total = sum(t.n_pairs + t.n_only_again for t in comparison.totals.values())
    lines.append(f"{total} estimates of up to {first} cycles in {seconds:.1f} s")
    return "\n".join(lines)


def _line(actuator: int, method: str, t: Totals) -> str:
    counts = f"{t.n_pairs:6d} {t.n_equal:6d} {t.n_only_logged:8d} {t.n_only_again:8d} {t.n_status:7d}"
    return f"{actuator:8d} {method:<7} {counts}" + "".join(f" {value:9.2g}" for value in t.rms)
