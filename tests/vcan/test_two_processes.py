"""`ema simulate` and `ema daemon` as two processes on vcan0; can-utils and cantools from outside say what they see."""

import re
import subprocess
import sys
import time
from operator import eq
from pathlib import Path

import numpy as np
import pytest
import yaml

from ema.bus.codec import default
from ema.bus.identifiers import ACTUATOR_MASK, actuator, message_id
from ema.core import resources
from ema.core.frames import FrameFlag
from ema.log import LogReader

PROGRAMS = Path(sys.executable).parent
NUMBERS = (5, 9)
N_CYCLES = 3
END = "7FF#00"  # no message: the last that candump is to see


@pytest.fixture(scope="module")
def flight(daemon_on_vcan0, tmp_path_factory):
    """Folder of a flight: candump.log (everything), log/ (the daemon's)."""
    folder = tmp_path_factory.mktemp("flight")
    daemon = daemon_on_vcan0(folder, NUMBERS)
    actuators = [{"number": number, "faults": {"k3": 0.02 * number}} for number in NUMBERS]
    scenario = {"period": 1.5, "n_cycles": N_CYCLES, "actuators": actuators}
    (folder / "scenario.yaml").write_text(yaml.safe_dump(scenario))
    with (folder / "candump.log").open("w") as out:
        witness = subprocess.Popen(["candump", "-L", "-r", "4000000", "vcan0"], stdout=out)
    words = [PROGRAMS / "ema", "simulate", "--scenario", folder / "scenario.yaml", "--bus", "vcan0"]
    simulator = subprocess.run(words, stderr=subprocess.PIPE, text=True, timeout=300, check=False)
    assert simulator.returncode == 0, simulator.stderr
    daemon.next("Heartbeat", lambda beat: beat["n_cycles"] == N_CYCLES * len(NUMBERS))
    assert daemon.stop() == 0
    subprocess.run(["cansend", "vcan0", END], check=True)
    keep_until_end(folder / "candump.log")
    witness.terminate()
    witness.wait()
    return folder


def keep_until_end(log, patience=120):
    """Wait for candump, which on a slow machine is behind and, terminated, would drop what it has not read."""
    deadline = time.monotonic() + patience
    while not (text := log.read_text()).rstrip().endswith(END):
        assert time.monotonic() < deadline, f"candump has not seen the end after {patience} s"
        time.sleep(0.2)
    log.write_text(text[: text.rindex("\n", 0, -1) + 1])


@pytest.fixture(scope="module")
def witnessed(flight):
    """(identifier, payload) of every frame candump has seen, in order."""
    found = []
    for line in (flight / "candump.log").read_text().splitlines():
        identifier, _, data = line.split()[2].partition("##")
        found.append((int(identifier, 16), bytes.fromhex(data[1:])))
    return found


def logged_estimates(folder):
    with LogReader(folder) as log:
        return [m.content for m in log.messages(lambda topic: topic.startswith("/estimate/"))]


def test_log_holds_every_frame_the_actuators_sent(flight, witnessed):
    codec, logged = default(), []
    with LogReader(flight / "log") as log:
        assert log.unfinished == []
        for _, frames in log.frames():
            assert not (frames["flags"] & FrameFlag.TX).any()
            rows = zip(frames["id"].tolist(), frames["length"].tolist(), frames["data"], strict=True)
            logged += [(identifier, data[:length].tobytes()) for identifier, length, data in rows]
    sent = [(i, data) for i, data in witnessed if codec.find(i).sender == "Actuator"]
    assert len(sent) > 500 * N_CYCLES * len(NUMBERS)
    assert len(logged) == len(sent)
    assert all(map(eq, logged, sent))  # where lists differ, `==` takes minutes to show it


def test_every_cycle_is_estimated(flight):
    linear = [e for e in logged_estimates(flight / "log") if e["method"] == "linear"]
    assert sorted((e["actuator"], e["cycle"]) for e in linear) == [(n, c) for n in NUMBERS for c in range(N_CYCLES)]
    for estimate in linear:
        assert "lost_frames" not in estimate["reasons"]


def test_cantools_decodes_what_the_log_says(flight, witnessed):
    """Its own program, its own decoder, on candump's own file: the numbers of the log, to the resolution of the bus."""
    dbc, mask = resources.dbc(), 0x1FFFFFFF & ~ACTUATOR_MASK
    words = [PROGRAMS / "cantools", "decode", "--single-line", "--no-decode-choices", "--frame-id-mask", hex(mask), dbc]
    with (flight / "candump.log").open() as log:
        lines = subprocess.run(words, stdin=log, stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()
    codec, seen = default(), {}
    for (identifier, _), line in zip(witnessed, lines, strict=True):
        name, _, values = line.partition(":: ")[2].partition("(")
        assert name == codec.find(identifier).name
        if name in ("EstimateLinear", "EstimateLf2"):
            signals = dict(re.findall(r"(\w+): ([-+.\deE]+)", values))
            key = (actuator(identifier), name.removeprefix("Estimate").lower(), int(signals["cycle"]))
            seen[key] = [float(signals[f"k{n}"]) for n in range(1, 7)]
    logged = {(e["actuator"], e["method"], e["cycle"]): e["k"] for e in logged_estimates(flight / "log")}
    resolution = codec.messages["EstimateLinear"].fields["k"].scale
    assert seen.keys() == logged.keys()
    for key, k in logged.items():
        assert seen[key] == pytest.approx(np.nan_to_num(np.array(k, dtype=float)), abs=0.51 * resolution)


def test_canplayer_gives_another_daemon_the_same_estimates(flight, daemon_on_vcan0, tmp_path):
    codec = default()
    lines = (flight / "candump.log").read_text().splitlines(keepends=True)
    sent = [line for line in lines if codec.find(int(line.split()[2].partition("##")[0], 16)).sender == "Actuator"]
    (tmp_path / "actuators.log").write_text("".join(sent))
    daemon = daemon_on_vcan0(tmp_path, NUMBERS)
    subprocess.run(["canplayer", "-I", tmp_path / "actuators.log"], check=True, timeout=120)
    daemon.next("Heartbeat", lambda beat: beat["n_cycles"] == N_CYCLES * len(NUMBERS))
    assert daemon.stop() == 0

    def linear(folder):
        return {
            (e["actuator"], e["cycle"]): (e["k"], e["sd"]) for e in logged_estimates(folder) if e["method"] == "linear"
        }

    assert linear(tmp_path / "log") == linear(flight / "log")


def test_identifiers_on_the_bus_are_those_of_the_dbc(witnessed):
    codec = default()
    assert {message_id(i) for i, _ in witnessed} <= {m.frame_id for m in codec.messages.values()}
