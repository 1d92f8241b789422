"""A daemon's log as a record: its cycles, assembled as the monitor does, for every command that takes records.

Positions come at a tenth of the rate of the currents and are interpolated; supply voltage and winding temperature are
the last ones heard before the cycle ended. A cycle with a gap is left out.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from ema.bus import codec as codecs
from ema.bus import identifiers
from ema.bus.codec import Codec
from ema.bus.protection import GOOD, Receiver
from ema.bus.span import MOTION_RATIO
from ema.core.config import validate
from ema.core.errors import LogError, NoCycleError, RecordError
from ema.core.records import Cycle, Record
from ema.log import LogReader
from ema.models.actuator import Actuator
from ema.models.turns import nearest_turn

from .assembler import Assembler
from .cycles import AssembledCycle
from .settings import MonitorSettings

_SUPPLY = "Supply"
_HEARD = ("u_dc", "temp_w")


def read_mcap(path: Path, _: object = None) -> Record:
    """The cycles of the one actuator in a log.

    Raises
    ------
    RecordError
        The log holds several actuators (`ema export --what cycles` takes them apart).
    NoCycleError
        It holds no whole cycle.
    """
    with LogReader(path) as log:
        found: dict[int, list[Cycle]] = {}
        broken: list[int] = []
        for actuator, cycle in cycles(log, broken):
            found.setdefault(actuator, []).append(cycle)
            if len(found) > 1:
                numbers = " and ".join(map(str, sorted(found)))
                raise RecordError(
                    f"{path}: holds actuators {numbers}; 'ema export {path} --what cycles --out DIR' takes them apart"
                )
        complaints = tuple(log.complaints())
    if not found:
        raise NoCycleError("; ".join([f"{path}: no cycle without a gap in it", *complaints]))
    return Record(tuple(next(iter(found.values()))), path, broken=tuple(broken), complaints=complaints)


def cycles(log: LogReader, broken: list[int] | None = None) -> Iterator[tuple[int, Cycle]]:
    """Actuator number and cycle, in the order they ended; numbers of cycles with gaps are added to `broken`.

    Raises
    ------
    RecordError
        The log does not say whose the cycles are.
    LogError
        The daemon's configuration in it is damaged.
    """
    codec = codecs.default()
    plants = _plants(log)
    assembler = Assembler(codec, plants, monitor_settings(configuration(log.attachments())))
    receiver = Receiver(codec, (_SUPPLY,), plants)
    supply: dict[int, dict[str, float]] = {}
    broken = [] if broken is None else broken
    for _, frames in log.frames():
        closed = [item for item in assembler.feed(frames) if isinstance(item, AssembledCycle)]
        yield from _whole(closed, plants, supply, broken)
        _hear(codec, receiver, frames, supply)
    closed = [item for item in assembler.finish() if isinstance(item, AssembledCycle)]
    yield from _whole(closed, plants, supply, broken)


def configuration(attached: dict[str, bytes]) -> dict[str, Any]:
    """The daemon's configuration among the files in a log, empty without one."""
    try:
        found = yaml.safe_load(attached.get("daemon.yaml", b""))
    except (yaml.YAMLError, ValueError) as error:
        raise LogError("daemon.yaml in the log is damaged") from error
    return found if isinstance(found, dict) and isinstance(found.get("actuators"), dict) else {}


def monitor_settings(configured: dict[str, Any]) -> MonitorSettings:
    """The monitor's settings in such a configuration."""
    return validate(configured.get("monitor", {}), MonitorSettings, "daemon.yaml in the log: monitor")


def _whole(
    closed: list[AssembledCycle],
    plants: dict[int, Actuator],
    supply: dict[int, dict[str, float]],
    broken: list[int],
) -> Iterator[tuple[int, Cycle]]:
    for cycle in closed:
        motion = np.array([cycle.motion[name] for name in ("theta_u", "theta_m", "theta_cmd")])
        if not cycle.missing.any() and np.isfinite(motion).all():
            yield cycle.actuator, _cycle(cycle, plants[cycle.actuator], supply.get(cycle.actuator, {}))
        else:
            broken.append(cycle.span.cycle)


def _cycle(cycle: AssembledCycle, plant: Actuator, supply: dict[str, float]) -> Cycle:
    n = cycle.i.shape[1]
    index = np.arange(n)
    t = index * cycle.span.period
    coarse = np.arange(cycle.span.n_motion_samples) * MOTION_RATIO
    theta_u = np.interp(index, coarse, cycle.motion["theta_u"])
    theta_m = np.unwrap(cycle.motion["theta_m"])
    theta_m += nearest_turn(cycle.motion["theta_u"][0], theta_m[0], plant.transmission.GR)
    channels = {
        "t": t,
        **dict(zip(("i_a", "i_b", "i_c"), cycle.i, strict=True)),
        "theta_m": np.interp(index, coarse, theta_m),
        "theta_u": theta_u,
        "theta_cmd": np.interp(index, coarse, cycle.motion["theta_cmd"]),
        **{name: np.full(n, value) for name, value in supply.items()},
    }
    return Cycle(cycle.span.cycle, channels, f"cycle {cycle.span.cycle}")


def _hear(codec: Codec, receiver: Receiver, frames: np.ndarray, supply: dict[int, dict[str, float]]) -> None:
    message = codec.messages[_SUPPLY]
    own = frames[identifiers.message_id(frames["id"]) == message.frame_id]
    own = own[receiver.check(own) <= GOOD]
    if len(own):
        values = message.decode(own)
        for row, number in enumerate(identifiers.actuator(own["id"]).tolist()):
            supply[number] = {name: float(values[name][row]) for name in _HEARD}


def _plants(log: LogReader) -> dict[int, Actuator]:
    """Actuators by number, from the bundles' manifests in the log; one manifest is that of all actuators."""
    plants: dict[int, Actuator] = {}
    for name, data in log.attachments().items():
        stem = name.removeprefix("manifest").removesuffix(".json")
        if stem == name or not (stem == "" or stem[1:].isdecimal()):
            continue
        try:
            plant = validate(json.loads(data)["plant"], Actuator, f"{name} in the log")
        except (ValueError, KeyError, TypeError) as error:
            raise RecordError(f"{log.paths[0]}: {name} in it is damaged") from error
        numbers = range(identifiers.N_ACTUATORS) if stem == "" else [int(stem[1:])]
        plants |= dict.fromkeys(numbers, plant)
    if not plants:
        raise RecordError(f"{log.paths[0]}: names no bundle, so how long a cycle is and whose is not known")
    return plants
