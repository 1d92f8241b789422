"""Recorded frames through the identifiers again: the monitor of the daemon, driven by a log."""

from __future__ import annotations

import json
from collections.abc import Iterator, Set
from dataclasses import dataclass

import click

from ema.alarms import AlarmSettings, Command, Warmth
from ema.bundle import Bundle
from ema.bundle import load as load_bundle
from ema.bus import codec as codecs
from ema.bus import identifiers
from ema.core.errors import BundleError, LogError
from ema.log import LogReader, Message, contents, schemas
from ema.log.schemas import Encoded
from ema.monitor import (
    Event,
    Identified,
    Job,
    LostJob,
    Monitor,
    MonitorSettings,
    Output,
    Runner,
    SampledEnvelope,
    Untimely,
    answered,
    marked_late,
)
from ema.monitor.recorded import configuration, monitor_settings

from .alarms_again import AlarmsAgain
from .open_log import names
from .received import Log, received, received_beside, worth_a_process
from .report_settings import of_log

_Key = tuple[int, int | None, str]  # t_ns, actuator, method
_LOOK_AT = 20_000  # frames of a log without configuration, to see whose they are


@dataclass(frozen=True)
class Setup:
    """What the frames are identified with.

    Attributes
    ----------
    bundles : dict of actuator number to Bundle
    settings : MonitorSettings
        Those of the log, or the defaults.
    same : bool
        Whether every bundle is the one that the log was made with.
    alarms : AlarmSettings or None
        Those of the log; None where it was made without alarms.
    """

    bundles: dict[int, Bundle]
    settings: MonitorSettings
    same: bool
    alarms: AlarmSettings | None = None


def setup(log: Log, given: tuple[str, ...]) -> Setup:
    """Bundles and settings by the log's attachments, and by what is `given`: PATH for all actuators, or NUMBER=PATH.

    Raises
    ------
    LogError, BundleError
        The log names no bundle, or the one it names is gone or has been built anew.
    """
    attached = log.attachments() if isinstance(log, LogReader) else {}
    configured = configuration(attached)
    named = {int(n): str(one["bundle"]) for n, one in configured.get("actuators", {}).items()}
    chosen = _given(given)
    wanted = {n for n in chosen if n is not None} - set(named)
    there = set(named) | (set(_actuators_in(log, wanted)) if wanted or not named else set())
    if absent := sorted(wanted - there):
        raise click.UsageError(f"--bundle {absent[0]}=…: {names(log.paths)} has no currents of actuator {absent[0]}")
    numbers = sorted(set(named) | wanted) or sorted(there)
    paths = {n: chosen.get(n) or chosen.get(None) or named.get(n) for n in numbers}
    if missing := [n for n, path in paths.items() if path is None]:
        raise LogError(f"{names(log.paths)}: names no bundle for actuator {missing[0]}: name one with --bundle PATH")
    loaded = {path: load_bundle(path) for path in sorted({str(path) for path in paths.values()})}
    bundles = {n: loaded[str(path)] for n, path in paths.items()}
    manifests = {n: attached.get(f"manifest-{n}.json", attached.get("manifest.json")) for n in numbers}
    same = {n: _is_same(bundles[n], text) for n, text in manifests.items() if text is not None}
    for n, is_same in same.items():
        if not is_same and n not in chosen and None not in chosen:
            raise BundleError(
                f"{paths[n]}: is not the bundle that the log was made with, it has been built again; "
                f"to compare the two, name it with --bundle"
            )
    is_same = len(same) == len(numbers) and all(same.values())
    return Setup(bundles, monitor_settings(configured), is_same, of_log(attached))


def identified(
    log: Log, how: Setup, channels: tuple[str, ...] = (), n_processes: int | None = None
) -> Iterator[Encoded | Message]:
    """The monitor's answers to all frames as the daemon would log them, and between them the ones it logged.

    Memory does not grow with the log.

    Parameters
    ----------
    n_processes : int, optional
        1, or 2: the log is read beside; the answers are the same. Default: 2 for a long log.

    Yields
    ------
    Encoded
        An answer.
    Message
        An estimate, or a change of an alarm, in the log.

    Raises
    ------
    LogError
        The frames are of several channels, and none was chosen.
    """
    beside = worth_a_process(log) if n_processes is None else n_processes > 1
    monitor, runner = Monitor(how.bundles, codecs.default(), how.settings), Runner(how.bundles)
    told = _told(log) if isinstance(log, LogReader) else {}
    left_out = {key for key, codes in told.items() if codes & set(LostJob)}
    alarms = AlarmsAgain(how.alarms, how.bundles)
    for item in (received_beside if beside else received)(log, how.bundles, how.settings, channels):
        if isinstance(item, Message):
            yield from alarms.logged(item)
            if item.topic.startswith("/estimate/") or (item.topic == schemas.ALARM.topic and alarms.follows):
                yield item
        elif isinstance(item, Command | Warmth):
            yield from alarms.hear(item)
        else:
            outputs = (o for o in monitor.judge([item]) if not (isinstance(o, Job) and _job(o) in left_out))
            for out in answered(outputs, monitor, runner):
                yield _encoded(_as_sent(out, told))
                yield from alarms.answer(out)


def _job(job: Job) -> _Key:
    return job.t_ns, job.actuator, job.method


def _told(log: LogReader) -> dict[_Key, set[str]]:
    """What the daemon decided by its clock, which a replay has not: jobs not done, and estimates that came too late.

    What jobs not done would have changed, the daemon never knew.
    """
    told: dict[_Key, set[str]] = {}
    for message in log.messages(lambda topic: topic == schemas.EVENT.topic):
        event = message.content
        if event.get("code") in {*LostJob, *Untimely}:
            method = event["text"].partition(":")[0]
            told.setdefault((event["t_ns"], event["actuator"], method), set()).add(event["code"])
    return told


def _as_sent(out: Output, told: dict[_Key, set[str]]) -> Output:
    if isinstance(out, Identified) and told.get((out.t_ns, out.actuator, out.estimate.method), set()) & set(Untimely):
        return marked_late(out)
    return out


def _encoded(answer: Output) -> Encoded:
    if isinstance(answer, Identified):
        content = contents.estimate(answer.t_ns, answer.actuator, answer.cycle, answer.estimate)
        return schemas.ESTIMATE.encode(content)
    if isinstance(answer, SampledEnvelope):
        values = answer.t, answer.measured, answer.model, answer.sd
        return schemas.ENVELOPE.encode(contents.envelope(answer.t_ns, answer.actuator, answer.cycle, *values))
    assert isinstance(answer, Event), "jobs are done by `answers`"
    event = contents.event(answer.t_ns, answer.level.value, answer.code, answer.text, answer.actuator)
    return schemas.EVENT.encode(event)


def _given(given: tuple[str, ...]) -> dict[int | None, str]:
    chosen: dict[int | None, str] = {}
    for text in given:
        number, equals, path = text.partition("=")
        if equals and number.isdecimal():
            who, place = int(number), path
        else:
            who, place = None, text
        if who in chosen:
            raise click.UsageError(
                f"--bundle is given twice for {'all actuators' if who is None else f'actuator {who}'}"
            )
        chosen[who] = place
    return chosen


def _actuators_in(log: Log, wanted: Set[int] = frozenset()) -> list[int]:
    """Whose currents the first frames of a log hold; more of them are read until all `wanted` are found."""
    currents = codecs.default().messages["PhaseCurrents"].frame_id
    found: set[int] = set()
    count = 0
    for _, frames in log.frames():
        own = frames["id"][identifiers.message_id(frames["id"]) == currents]
        found |= set(identifiers.actuator(own).tolist())
        count += len(frames)
        if count > _LOOK_AT and wanted <= found:
            break
    if not found:
        raise LogError(
            f"{names(log.paths)}: none of the first {count} frames is a PhaseCurrents frame of this project's DBC"
        )
    return sorted(found)


def _is_same(bundle: Bundle, text: bytes) -> bool:
    try:
        return bool(json.loads(text) == bundle.manifest)
    except ValueError:
        return False
