"""The report's page from a log."""

from __future__ import annotations

import base64
import json
from importlib.resources import files
from typing import Any

import jinja2
import matplotlib
import yaml
from markupsafe import Markup

from ema.core import pages
from ema.core.names import FAULT_MEANING, FAULTS
from ema.core.status import Status
from ema.core.version import version
from ema.core.words import REASON_MEANING, STATUS_MEANING
from ema.log import LogReader

from .health import Health, health
from .history import ActuatorHistory, read
from .report_settings import ReportSettings, Severity
from .times import iso

# Counters of the heartbeat (`daemon/health.py`) in words; others are shown by their names.
_COUNTED = {
    "n_cycles": "cycles of all actuators",
    "n_estimates": "cycles with a usable estimate",
    "n_good": "frames without fault",
    "n_lost": "frames lost",
    "n_reordered": "frames late",
    "n_repeated": "frames sent twice",
    "n_crc_error": "frames with a wrong CRC",
    "n_wrong_counter": "frames with a wrong counter",
    "n_wrong_length": "frames of a wrong length",
    "n_refused": "frames that message authentication refused",
    "n_timeout": "messages that did not come in time",
    "n_foreign": "frames of others",
    "kernel_drops": "frames dropped by the kernel",
    "n_received": "frames received",
    "n_sent": "frames sent",
    "n_send_failed": "frames not sent",
    "n_error_frames": "error frames of the CAN controller",
    "n_unreadable": "frames that could not be read",
    "n_link_down": "times the link was down",
    "n_not_logged": "frames and messages not logged",
    "n_skipped": "cycles that a slower identifier skipped",
    "n_failed": "cycles in which a slower identifier failed",
}


def page(log: LogReader, settings: ReportSettings) -> str:
    """HTML of the report. LogError when the log holds no estimate."""
    matplotlib.use("svg")
    history = read(log, settings)
    attachments = log.attachments()
    actuators = [_actuator(one, health(one, settings, history.last_ns), settings) for one in history.actuators.values()]
    return pages.with_scrolling_tables(
        _environment()
        .get_template("report.html.j2")
        .render(
            actuators=actuators,
            history=history,
            counted=_COUNTED,
            settings=settings,
            severities={"none": None} | {s.name.lower(): s for s in Severity},
            faults=FAULTS,
            meanings=FAULT_MEANING,
            begin=iso(history.first_ns),
            end=iso(history.last_ns),
            duration=span((history.last_ns - history.first_ns) / 1e9),
            logs=log.paths,
            copies=log.copies,
            unfinished=log.unfinished,
            damage=log.damage,
            software=log.metadata().get("software", "not named in the log"),
            reporter=f"ema-monitor {version()}",
            bundles=_bundles(attachments),
            daemon_yaml=attachments.get("daemon.yaml", b"").decode(errors="replace"),
            report_yaml=yaml.safe_dump(settings.model_dump(mode="json"), sort_keys=False),
            css=Markup(pages.style()),
            status_words=STATUS_MEANING,
            reason_words=REASON_MEANING,
            remarked={reason for a in actuators for reason in a["history"].reasons},
        )
    )


def span(seconds: float) -> str:
    """A length of time for people."""
    for limit, unit, name in ((120, 1, "s"), (7200, 60, "min"), (172800, 3600, "h")):
        if seconds < limit:
            return f"{seconds / unit:.3g} {name}"
    return f"{seconds / 86400:.3g} d"


def _badge(severity: Severity | None) -> Markup:
    name = "unknown" if severity is None else Severity(severity).name.lower()
    return Markup('<span class="badge {0}">{0}</span>').format(name)


def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(lambda name: files(__package__).joinpath(name).read_text(encoding="utf-8")),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals.update(badge=_badge, iso=iso, span=span)
    return environment


def _actuator(actuator: ActuatorHistory, now: Health, settings: ReportSettings) -> dict[str, Any]:
    from . import figures

    envelopes = []
    if actuator.last is not None:
        envelopes.append((f"cycle {actuator.last['cycle']}, the last", actuator.last))
    if actuator.worst is not None and "measured" in actuator.worst:
        caption = f"cycle {actuator.worst['cycle']}, the least likely (p = {actuator.worst_p:.2g})"
        envelopes.append((caption, actuator.worst))
    return {
        "history": actuator,
        "health": now,
        "statuses": [(s.name.lower(), actuator.statuses[s.name.lower()]) for s in Status],
        "beside": _inline(figures.beside(actuator)) if actuator.beside else "",
        "trend": _inline(figures.trend(actuator, now, settings)),
        "numbers": "; ".join(f"{f.fault} {f.k:.3f} ± {f.sd:.3f}" for f in now.faults),
        "envelopes": [{"caption": text, "src": _inline(figures.envelope(content))} for text, content in envelopes],
    }


def _inline(svg: str) -> str:
    return "data:image/svg+xml;base64," + base64.b64encode(svg.encode()).decode()


def _bundles(attachments: dict[str, bytes]) -> list[dict[str, str]]:
    found = []
    for name, data in sorted(attachments.items()):
        if not name.startswith("manifest"):
            continue
        try:
            manifest = json.loads(data)
            plant = manifest.get("plant", {})
            found.append(
                {
                    "name": name,
                    "software": str(manifest.get("software", "?")),
                    "plant": str(plant.get("name", "?")),
                    "plant_hash": str(manifest.get("plant_hash", "?")),
                    "extension": _extension(plant.get("effects", {})),
                }
            )
        except (ValueError, AttributeError):
            found.append({"name": name, "software": "?", "plant": "damaged", "plant_hash": "?", "extension": ""})
    return found


def _extension(effects: dict[str, dict[str, float]]) -> str:
    """What the plant has beyond the nominal model, in words."""
    if not effects:
        return ""
    from ema.effects import registry  # needs a JIT: only where there is something to say

    known = registry()
    return "; ".join(
        known[name].said(values) if name in known else f"{name}, unknown here" for name, values in effects.items()
    )
