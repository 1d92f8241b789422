"""What this machine has for the monitor, and what to do about what is missing."""

from __future__ import annotations

import ctypes
import os
import platform
import shutil
import socket
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from importlib import metadata
from pathlib import Path

from ema.bundle import Bundle
from ema.bus.interface import BusSettings, open_bus
from ema.bus.port import RECEIVE_BUFFER
from ema.core.errors import EmaError
from ema.core.version import version

from .settings import load, load_alarms, load_bundles

_FD_MTU = 72
_ARPHRD_CAN = "280"
_TIME_ERROR = 5  # of adjtimex: the clock is not synchronised
_PACKAGES = ("numpy", "scipy", "python-can", "cantools", "mcap", "autosar-e2e", "cryptography")
_MB = 1_000_000


class Verdict(StrEnum):
    """Of one check."""

    OK = "ok"
    WARNING = "warning"  # works, but not as well as it could
    BAD = "bad"  # the monitor will not work


@dataclass(frozen=True)
class Finding:
    """One thing looked at; `remedy` is empty when there is nothing to do."""

    what: str
    verdict: Verdict
    found: str
    remedy: str = ""


def checkup(config_path: Path | None, bus: BusSettings | None) -> Iterator[Finding]:
    """Everything, one after the other; a configuration is looked at when there is one."""
    yield _software()
    yield from _can()
    yield _buffer()
    yield _bus(bus or BusSettings())
    yield _clock()
    yield _processors()
    yield _service_manager()
    if config_path is not None:
        yield from _configuration(config_path)


def _software() -> Finding:
    versions = [f"Python {sys.version.split()[0]}", f"ema-monitor {version()}"]
    for package in _PACKAGES:
        try:
            versions.append(f"{package} {metadata.version(package)}")
        except metadata.PackageNotFoundError:
            return Finding("software", Verdict.BAD, f"{package} is not installed", f"pip install {package}")
    return Finding("software", Verdict.OK, ", ".join(versions))


def _can() -> Iterator[Finding]:
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except (AttributeError, OSError) as error:
        found = f"kernel {platform.release()} has none ({getattr(error, 'strerror', error)})"
        yield Finding(
            "kernel CAN", Verdict.WARNING, found, "modprobe can can-raw vcan; until then UDP multicast is used"
        )
        return
    yield Finding("kernel CAN", Verdict.OK, f"kernel {platform.release()}")
    interfaces = [path.parent for path in Path("/sys/class/net").glob("*/type") if _read(path) == _ARPHRD_CAN]
    if not interfaces:
        remedy = "ip link add dev vcan0 type vcan; ip link set vcan0 mtu 72 up"
        yield Finding("CAN interfaces", Verdict.WARNING, "none", remedy)
    for path in sorted(interfaces):
        mtu, state = int(_read(path / "mtu")), _read(path / "operstate")
        name, found = f"CAN interface {path.name}", f"MTU {mtu}, {state}"
        if mtu < _FD_MTU:
            yield Finding(name, Verdict.BAD, found, f"CAN FD needs MTU 72: ip link set {path.name} mtu 72")
        elif state == "down":
            yield Finding(name, Verdict.WARNING, found, f"ip link set {path.name} up")
        else:
            yield Finding(name, Verdict.OK, found)


def _buffer() -> Finding:
    try:
        limit = int(_read(Path("/proc/sys/net/core/rmem_max")))
    except (OSError, ValueError):
        return Finding("receive buffer", Verdict.WARNING, "its limit cannot be read")
    found = f"net.core.rmem_max = {limit}, {RECEIVE_BUFFER} is asked for"
    if limit >= RECEIVE_BUFFER:
        return Finding("receive buffer", Verdict.OK, found)
    remedy = f"sysctl net.core.rmem_max={RECEIVE_BUFFER}, or install systemd/90-ema-can.conf"
    return Finding("receive buffer", Verdict.WARNING, found, remedy)


def _bus(settings: BusSettings) -> Finding:
    try:
        with open_bus(settings) as port:
            return Finding("bus", Verdict.OK, port.choice)
    except EmaError as error:
        return Finding("bus", Verdict.BAD, str(error), "name another bus, or set this one up")


def _clock() -> Finding:
    buffer = ctypes.create_string_buffer(512)  # struct timex, all zero: only ask
    try:
        state = ctypes.CDLL(None, use_errno=True).adjtimex(buffer)
    except (OSError, AttributeError):
        state = -1
    if state < 0:
        return Finding("clock", Verdict.WARNING, "whether it is synchronised cannot be asked")
    if state == _TIME_ERROR:
        return Finding(
            "clock", Verdict.WARNING, "not synchronised", "start systemd-timesyncd or chrony: logs need the time"
        )
    return Finding("clock", Verdict.OK, "synchronised")


def _processors() -> Finding:
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 1e9
    return Finding("machine", Verdict.OK, f"{os.cpu_count()} processors, {memory:.1f} GB of memory")


def _service_manager() -> Finding:
    if Path("/run/systemd/system").is_dir():
        return Finding("service manager", Verdict.OK, "systemd runs")
    remedy = "the daemon then needs another supervisor that starts it again"
    return Finding("service manager", Verdict.WARNING, "systemd does not run here", remedy)


def _configuration(path: Path) -> Iterator[Finding]:
    try:
        settings = load(path)
    except EmaError as error:
        yield Finding("configuration", Verdict.BAD, str(error), "correct the file")
        return
    yield Finding("configuration", Verdict.OK, f"{path}: {len(settings.actuators)} actuators")
    try:
        bundles = load_bundles(settings)
        made = sorted({_bundle(bundle) for bundle in bundles.values()})
        yield Finding("bundles", Verdict.OK, "; ".join(made))
    except EmaError as error:
        yield Finding("bundles", Verdict.BAD, str(error), "build it for this actuator: ema build --config … --out …")
    try:
        load_alarms(settings)
        yield Finding("thresholds of alarms", Verdict.OK, settings.alarms.file or "as shipped")
    except EmaError as error:
        yield Finding("thresholds of alarms", Verdict.BAD, str(error), "correct the file")
    yield _log_directory(Path(settings.log.directory), settings.log.keep_free)


def _bundle(bundle: Bundle) -> str:
    said = f"{bundle.path} by {bundle.manifest['software']}"
    effects = bundle.plant.effects.items()
    terms = [f"{name} {parameter} = {x:g}" for name, values in effects for parameter, x in values.items()]
    return f"{said}, extended: {', '.join(terms)}" if terms else said


def _log_directory(directory: Path, keep_free: float) -> Finding:
    if not directory.is_dir():
        return Finding("log directory", Verdict.BAD, f"{directory} does not exist", f"mkdir -p {directory}")
    if not os.access(directory, os.W_OK):
        return Finding("log directory", Verdict.BAD, f"{directory} cannot be written", "change its owner or mode")
    free = shutil.disk_usage(directory).free / _MB
    found = f"{directory}: {free:.0f} MB free"
    if free < keep_free:
        return Finding("log directory", Verdict.BAD, found, f"the log keeps {keep_free:g} MB free: make room")
    if free < 10 * keep_free:
        return Finding("log directory", Verdict.WARNING, found, "old segments will soon be deleted for new ones")
    return Finding("log directory", Verdict.OK, found)


def _read(path: Path) -> str:
    return path.read_text(encoding="ascii").strip()
