"""`ema simulate` as a user calls it."""

import csv
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from ema_simulator.injection import FaultSource
from ema_simulator.node import run
from ema_simulator.scenario import load

from ema.bus.interface import open_bus, parse
from ema.bus.protection import Check, Receiver
from ema.core.records import read_record

EMA = Path(sys.executable).with_name("ema")


def ema(*words, **options):
    return subprocess.run([EMA, *map(str, words)], capture_output=True, text=True, timeout=120, **options)


def test_a_record_is_written_with_its_truth(write, tmp_path):
    path = write("n_cycles: 2\nactuators: [{number: 3, faults: {k3: [[0, 0.0], [1, 0.2]]}}]")
    done = ema("simulate", "--scenario", path, "--csv", tmp_path / "x.csv", "--truth", tmp_path / "t.csv")
    assert (done.returncode, done.stdout) == (0, "")
    record = read_record(tmp_path / "x.csv")
    assert record.n_cycles == 2
    assert {"i_a", "theta_m", "u_dc", "temp_w"} < set(record.channels)
    rows = list(csv.DictReader((tmp_path / "t.csv").read_text().splitlines()))
    assert [(row["cycle"], row["actuator"], float(row["k3"])) for row in rows] == [("0", "3", 0.0), ("1", "3", 0.2)]


@pytest.mark.parametrize(
    ("text", "words", "said"),
    [
        ("n_cycles: 1\nseed: -1", [], "seed"),
        ("seed: 1", ["--csv", "x.csv", "--truth", "t.csv"], "a record needs an end"),
        ("n_cycles: 1\nactuators: [{number: 1}, {number: 2}]", ["--csv", "x.csv"], "--actuator"),
        ("n_cycles: 1", ["--bus", "nonsense:x"], "bus nonsense:x cannot be opened"),
        ("n_cycles: 1", ["--rate", "0"], "--rate"),
        ("n_cycles: 1", ["--csv", "x.csv", "--bus", "virtual"], "--bus has no meaning"),
        ("n_cycles: 1", ["--csv", "x.csv", "--rate", "2"], "--rate has no meaning"),
        ("n_cycles: 1", ["--bus", "virtual", "--actuator", "0"], "--actuator says which one"),
        ("n_cycles: 1", ["--csv", "x.csv", "--truth", "./x.csv"], "--csv and --truth are the same file"),
        ("n_cycles: 1", ["--csv", "nowhere/x.csv"], "nowhere is no directory"),
        ("n_cycles: 1", ["--truth", "/nowhere/t.csv"], "/nowhere/t.csv: cannot be written"),
    ],
)
def test_wrong_use_is_one_line_and_status_2(write, tmp_path, text, words, said):
    done = ema("simulate", "--scenario", write(text), *words, cwd=tmp_path)
    assert done.returncode == 2
    assert said in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not list(tmp_path.glob("*.csv"))


def test_a_record_that_is_there_already_is_refused_before_any_work(write, tmp_path):
    """Before the faults' file is begun, and however long the simulation would take."""
    (tmp_path / "x.csv").write_text("mine")
    words = ["--csv", "x.csv", "--truth", "t.csv", "--cycles", 1_000_000]
    done = ema("simulate", "--scenario", write("seed: 1"), *words, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (2, "ema: x.csv: exists already, is not overwritten\n")
    assert not (tmp_path / "t.csv").exists()


def test_a_record_larger_than_the_machine_is_refused_before_any_work(write, tmp_path):
    words = ["--csv", "x.csv", "--cycles", 10**9]
    done = ema("simulate", "--scenario", write("seed: 1"), *words, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith(
        "ema: a record of 1000000000 cycles does not fit into this machine's memory: at most "
    )
    assert done.stderr.count("\n") == 1
    assert not list(tmp_path.glob("*.csv"))


def test_nothing_is_overwritten(write, tmp_path):
    (tmp_path / "t.csv").write_text("mine")
    done = ema("simulate", "--scenario", write("n_cycles: 1"), "--truth", tmp_path / "t.csv")
    assert done.returncode == 2
    assert (tmp_path / "t.csv").read_text() == "mine"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_cleanly(write, tmp_path, number):
    truth = tmp_path / "t.csv"
    process = subprocess.Popen(
        [EMA, "simulate", "--scenario", write("seed: 0"), "--bus", "virtual", "--truth", truth],
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 60
    while not (truth.exists() and truth.read_text().count("\n") > 1):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    process.send_signal(number)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 0
    assert "cycles," in errors
    assert "Traceback" not in errors


def test_on_the_bus_at_a_given_rate(write, codec):
    """A node in this process, faster than real time: everything arrives, in order, protected."""
    scenario, plant = load(write("n_cycles: 3\nrate: 5\nactuators: [{number: 0}, {number: 1}]"))
    received = []
    with open_bus(parse("virtual:sim")) as listener, open_bus(parse("virtual:sim")) as port:
        seen = []
        node = threading.Thread(
            target=lambda: seen.append(run(scenario, plant, port, codec, threading.Event())), daemon=True
        )
        node.start()
        while node.is_alive():
            received.append(listener.read(0.1))
        received.append(listener.read(0.1))
        node.join()
    (summary,) = seen
    frames = np.concatenate(received)
    assert summary.n_cycles == 3
    assert frames.size == summary.n_frames == 3 * 2 * (501 + 51 + 10 + 2)
    assert (Receiver(codec).check(frames) == Check.OK).all()


def test_authenticated_traffic_is_passed_whole(write, codec, tmp_path):
    key = tmp_path / "key"
    key.write_text("00" * 16)
    key.chmod(0o600)
    place = parse("virtual:locked").model_copy(update={"key_file": key})
    scenario, plant = load(write("n_cycles: 4\nrate: 2"))
    received = []
    with open_bus(place) as listener, open_bus(place, role="Actuator") as port:
        node = threading.Thread(target=run, args=(scenario, plant, port, codec, threading.Event()), daemon=True)
        node.start()
        while node.is_alive():
            received.append(listener.read(0.02))
        received += [listener.read(0.05) for _ in range(4)]
    frames = np.concatenate(received)
    assert frames.size == 4 * (501 + 51 + 10 + 2)
    checks = Receiver(codec).check(frames)
    unknown = checks == Check.REFUSED  # until the listener has asked who this is
    assert (checks[~unknown] <= Check.SOME_LOST).all()
    assert (~unknown).any()
    t_ns = frames["t_ns"]
    assert t_ns[unknown].max(initial=0) <= t_ns[~unknown].min(), "whoever is known stays so"


@pytest.mark.parametrize("with_key", [False, True])
def test_faults_injected_from_another_process_are_taken(write, codec, tmp_path, with_key):
    """Twice: a second call is a sender that has restarted."""
    place, key = parse("udp_multicast:239.74.163.55"), tmp_path / "key"
    key.write_text("00" * 16)
    key.chmod(0o600)
    key_words = ["--key-file", key] if with_key else []
    scenario, _ = load(write("allow_injection: true\nactuators: [{number: 2}]"))
    faults = FaultSource(scenario, codec)
    place = place.model_copy(update={"key_file": key if with_key else None})
    with open_bus(place, codec.filters("Tester"), "Actuator") as port:
        for k3 in (0.2, 0.3):
            words = ["inject", f"k3={k3}", "k1=0.05", "--actuator", 2, "--bus", "udp_multicast:239.74.163.55"]
            with ThreadPoolExecutor(1) as pool:
                done = pool.submit(ema, *words, *key_words)
                while not done.done():
                    faults.listen(port.read(0.05), t=1.0)
            assert done.result().returncode == 0
            faults.listen(port.read(0.2), t=1.0)
            assert faults.at(2.0)[0] == pytest.approx([0.05, 0, k3, 0, 0, 0])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["k7=0.1"], "the faults are"),
        (["k3=2"], "within 0…1"),
        (["k3"], "within 0…1"),
        (["k1=0.1", "k1=0.2"], "k1 is given twice"),
    ],
)
def test_wrong_faults_are_refused(words, said):
    done = ema("inject", *words, "--bus", "virtual")
    assert done.returncode == 2
    assert said in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
