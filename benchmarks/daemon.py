"""The daemon in steady state: start-up, latency on the bus, memory, processor.

    python -m benchmarks.daemon --bundle var/bundle [--actuators 1] [--cycles 20]

A listener of its own hears the actuators and the daemon on the bus; latency is from the last frame of a cycle to the
linear estimate of that cycle, both by the kernel's receive time. One figure of it means little while others use the
machine: the load average is printed beside.
"""

from __future__ import annotations

import argparse
import os
import signal
import socket
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import yaml

from ema.bus import codec as codecs
from ema.bus import identifiers
from ema.bus.interface import BusSettings, open_bus

from .rig import EMA, figures

SEED = 3
N_FRAMES = 564  # of one actuator in a second with one test cycle


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bundle", type=Path, required=True)
    parser.add_argument("--actuators", type=int, default=1)
    parser.add_argument("--cycles", type=int, default=20)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        run(Path(folder), options.bundle.resolve(), options.actuators, options.cycles)


def run(folder: Path, bundle: Path, n_actuators: int, n_cycles: int) -> None:
    pid = os.getpid()
    bus = {"interface": "udp_multicast", "channel": f"239.75.{pid % 250}.{pid // 250 % 250}"}
    numbers = range(n_actuators)
    (folder / "log").mkdir()
    daemon_yaml, scenario_yaml = folder / "daemon.yaml", folder / "scenario.yaml"
    actuators = {n: {"bundle": str(bundle)} for n in numbers}
    daemon_yaml.write_text(yaml.safe_dump({"bus": bus, "actuators": actuators, "log": {"directory": "log"}}))
    scenario = {"bus": bus, "n_cycles": n_cycles, "seed": SEED, "actuators": [{"number": n} for n in numbers]}
    scenario_yaml.write_text(yaml.safe_dump(scenario))
    codec = codecs.default()
    heard = []
    with open_bus(BusSettings(**bus)) as port, socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(folder / "notify"))
        began = time.time_ns()
        environment = {**os.environ, "NOTIFY_SOCKET": str(folder / "notify")}
        with (folder / "said.txt").open("w") as said:
            daemon = subprocess.Popen([EMA, "daemon", "--config", daemon_yaml], env=environment, stderr=said)
        first_beat = 0
        while not first_beat:
            if daemon.poll() is not None:
                raise SystemExit(f"the daemon does not start: {(folder / 'said.txt').read_text().strip()}")
            frames = port.read(1.0)
            first_beat = int(frames["t_ns"][0]) if frames.size else 0
        before = figures(daemon.pid), time.monotonic()
        simulator = subprocess.Popen([EMA, "simulate", "--scenario", scenario_yaml], stderr=subprocess.DEVNULL)
        began_cycles = None
        while simulator.poll() is None:
            frames = port.read(0.2)
            if began_cycles is None and (codec_id(frames, codec, "CycleStart")).any():
                began_cycles, before = time.monotonic(), (figures(daemon.pid), time.monotonic())
            heard.append(frames)
        after = figures(daemon.pid), time.monotonic()
        heard.append(port.read(1.0))
        daemon.send_signal(signal.SIGTERM)
        status = daemon.wait(30)
    latency = latencies(np.concatenate(heard), codec)
    cpu = (after[0].cpu - before[0].cpu) / (after[1] - before[1])
    print(f"start to first heartbeat   {(first_beat - began) / 1e9:8.2f} s")
    print(f"cycles answered            {latency.size:8d} of {n_actuators * n_cycles} (seed {SEED})")
    for name, q in (("median", 50), ("p99", 99), ("largest", 100)):
        print(f"latency, {name:<10}        {np.percentile(latency, q):8.2f} ms")
    print(f"memory (RSS)               {after[0].rss / 1e6:8.0f} MB, {after[0].n_threads} threads")
    print(f"processor for each actuator{100 * cpu / n_actuators:8.1f} % of a core at {N_FRAMES} frames/s")
    print(f"load average               {os.getloadavg()[0]:8.1f} on {os.cpu_count()} cores; exit status {status}")


def codec_id(frames: np.ndarray, codec: codecs.Codec, name: str) -> np.ndarray:
    return identifiers.message_id(frames["id"]) == codec.messages[name].frame_id


def latencies(frames: np.ndarray, codec: codecs.Codec) -> np.ndarray:
    """From CycleEnd, sent right behind a cycle's last currents, to EstimateLinear, of each cycle. [ms]"""
    times: dict[str, dict[tuple[int, int], int]] = {}
    for name in ("CycleEnd", "EstimateLinear"):
        own = frames[codec_id(frames, codec, name)]
        cycles = codec.messages[name].decode(own)["cycle"].tolist()
        keys = zip(identifiers.actuator(own["id"]).tolist(), cycles, strict=True)
        times[name] = dict(zip(keys, own["t_ns"].tolist(), strict=True))
    answered = times["EstimateLinear"].keys() & times["CycleEnd"].keys()
    return np.array([(times["EstimateLinear"][key] - times["CycleEnd"][key]) / 1e6 for key in answered])


if __name__ == "__main__":
    main()
