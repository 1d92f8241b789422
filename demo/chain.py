"""The stages: bundle, bus, flight, report."""

from __future__ import annotations

import json
import signal
import time
from importlib.metadata import entry_points
from subprocess import Popen
from typing import Any

import yaml
from rich.console import Console

from ema import bundle as bundles
from ema.bus.interface import open_bus, parse
from ema.core import config, resources
from ema.core.errors import BundleError, EmaError, NegativeAnswer
from ema.models.actuator import Actuator

from . import stage
from .watch import Watch

_READY_IN = 60.0  # [s]


def make_bundle(files: stage.Files, console: Console) -> None:
    """Build the quick bundle unless one for the shipped actuator is there."""
    plant = resources.config("actuator.yaml")
    try:
        fits = config.digest(bundles.load(files.bundle).plant) == config.digest(config.load(plant, Actuator))
    except BundleError:
        fits = False
    if fits:
        console.print(f"bundle {files.bundle} is used again")
        return
    console.print("bundle is built by 'ema build' (under a minute)")
    words = ("build", "--config", resources.config("builder-quick.yaml"), "--out", files.bundle)
    stage.finished(stage.run(*words), "build")


def choose_bus(wanted: str) -> tuple[str, str]:
    """Name of the bus for both programs, and why it was chosen."""
    with open_bus(parse(wanted)) as port:
        return port.name, port.choice


def write_configuration(files: stage.Files, bus: str, n_cycles: int | None) -> None:
    """Scenario and daemon configuration of this demo."""
    scenario = yaml.safe_load(resources.config("scenario-demo.yaml").read_text(encoding="utf-8"))
    interface, _, channel = bus.partition(":")
    settings = {"interface": interface, "channel": channel}
    scenario |= {"bus": settings} | ({"n_cycles": n_cycles} if n_cycles else {})
    daemon = {
        "bus": settings,
        "actuators": {0: {"bundle": "bundle"}},
        "log": {"directory": "log"},
        "monitor": {"slower": {"lf2": {"every": 2.0}}},
    }
    for path, content in ((files.scenario, scenario), (files.daemon, daemon)):
        path.write_text(yaml.safe_dump(content, sort_keys=False, allow_unicode=True), encoding="utf-8")


def fly(files: stage.Files, bus: str, console: Console) -> None:
    """Daemon and simulator on the bus until the scenario is over."""
    simulate = ("simulate", "--scenario", files.scenario, "--truth", files.truth)
    daemon = ("daemon", "--config", files.daemon)
    if bus.startswith("virtual:"):
        together = stage.run(*daemon, "--", *simulate, output=files.said, program=stage.TOGETHER)
        stage.finished(together, "daemon and simulate in one process", files.said)
        return
    n_cycles = int(yaml.safe_load(files.scenario.read_text(encoding="utf-8"))["n_cycles"])
    with stage.service_manager() as manager:
        service = stage.run(*daemon, output=files.said, NOTIFY_SOCKET=stage.address(manager))
        try:
            _wait_until_ready(service, manager, files)
            simulator = stage.run(*simulate, output=files.simulator_said)
            try:
                with Watch(bus, n_cycles, console) as watch:
                    while simulator.poll() is None:
                        watch.look(0.1)
                    watch.look(stage.LAST_ANSWERS)
                stage.finished(simulator, "simulate", files.simulator_said)
            finally:
                _end(simulator)
            service.send_signal(signal.SIGTERM)
            stage.finished(service, "daemon", files.said)
        finally:
            _end(service)


def replay(files: stage.Files) -> int:
    """`ema replay --identify`: how many estimates of the log come out again bit for bit, if all of them do.

    Raises
    ------
    NegativeAnswer
        One does not.
    """
    replayed = stage.run("replay", files.log, "--identify", "--json", output=files.replayed)
    if replayed.wait() > 1:
        stage.finished(replayed, "replay", files.replayed)
    answer = json.loads(files.replayed.read_text(encoding="utf-8").partition("\nema: ")[0])
    if answer["n_different"] or not answer["same_bundle"]:
        raise NegativeAnswer(f"{answer['n_different']} replayed estimates differ from the log's, see {files.replayed}")
    return int(answer["n_equal"])


def make_report(files: stage.Files, console: Console) -> None:
    """`ema report`, where it is installed."""
    if entry_points(group="ema.commands", name="report"):
        stage.finished(stage.run("report", files.log, "--out", files.report), "report")
    else:
        console.print("no 'ema report' here: no report.html")


def _wait_until_ready(service: Popen[bytes], manager: Any, files: stage.Files) -> None:
    manager.settimeout(0.2)
    end = time.monotonic() + _READY_IN
    while time.monotonic() < end:
        try:
            if b"READY=1" in manager.recv(4096):
                return
        except TimeoutError:
            if service.poll() is not None:
                stage.finished(service, "daemon", files.said)
    raise EmaError(f"'ema daemon' was not ready within {_READY_IN:.0f} s, see {files.said}")


def _end(process: Popen[bytes]) -> None:
    if process.poll() is None:
        process.kill()
        process.wait()
