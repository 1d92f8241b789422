"""The service on a machine with a real systemd: `scenario.py` is what happens there, here is judged what it left."""

import json
import re
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from ema_daemon.alarming import MESSAGE_ID

from ema.bus.codec import default
from ema.core import frames as fr
from ema.log import LogReader

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
DAEMON_YAML = """
actuators: {0: {bundle: bundle}}
log: {directory: /var/log/ema/vcan0, flush_interval: 1 s}
monitor: {slower: {hf: {every: 1 s}}}
remote: {hf: /run/ema-hf/vcan0/hf.sock}
"""
SCENARIO_YAML = """
period: 1.5 s
actuators: [{number: 0, faults: {k3: 0.05}}]
"""
AT_SHUTDOWN = """#!/bin/sh
cp -rL /var/log/ema/vcan0 /run/job/after_shutdown
"""

pytestmark = [pytest.mark.systemd, pytest.mark.slow, pytest.mark.timeout(1200)]


@pytest.fixture(scope="module")
def machine(request, coarse_bundle, tmp_path_factory):
    """Folder with what the machine has left: facts.json, transcript.txt, bus.log, journal.txt, copies of its log."""
    if request.config.getoption("markexpr") != "systemd":
        pytest.skip("boots a machine: use `make test-systemd`")
    job = tmp_path_factory.mktemp("machine")
    shutil.copytree(coarse_bundle.path, job / "bundle")
    for path in (HERE / "scenario.py", HERE / "ema-simulator.service", ROOT / "tools/install_service"):
        shutil.copy(path, job)
    (job / "daemon.yaml").write_text(DAEMON_YAML)
    (job / "scenario.yaml").write_text(SCENARIO_YAML)
    ids = {method: default().messages[f"Estimate{method.capitalize()}"].frame_id for method in ("linear", "hf")}
    (job / "ids.json").write_text(json.dumps({method: f"{identifier:08X}" for method, identifier in ids.items()}))
    (job / "message_id").write_text(MESSAGE_ID)
    (job / "at-shutdown").write_text(AT_SHUTDOWN)
    (job / "at-shutdown").chmod(0o755)
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    source = job / "source"  # setuptools builds inside the source tree
    shutil.copytree(
        ROOT, source, ignore=shutil.ignore_patterns(".*", "__pycache__", "build", "dist", "*.egg-info", "out", "var")
    )
    subprocess.run([*pip, "--wheel-dir", job, source], check=True)
    shutil.rmtree(source)
    (wheel,) = job.glob("*.whl")
    subprocess.run([ROOT / "tools/build_deb", wheel, job], check=True, stdout=subprocess.DEVNULL)
    words = [sys.executable, ROOT / "tools/on_systemd.py", "--timeout", "900", "--job", job, "python3", "scenario.py"]
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    (job / "transcript.txt").write_text(done.stdout)
    kept = ROOT / "var/systemd-transcript.txt"
    kept.parent.mkdir(exist_ok=True)
    kept.write_text(done.stdout)
    assert done.returncode == 0, done.stdout[-6000:]
    return job


@pytest.fixture(scope="module")
def facts(machine):
    return json.loads((machine / "facts.json").read_text())


def segments(folder):
    return sorted(folder.glob("*.mcap"))


def estimates(folder):
    """Linear estimates in a log, in order: (cycle, k as the bus carries them: 0 where a cycle was refused)."""
    scale = default().messages["EstimateLinear"].fields["k"].scale
    with LogReader(folder) as log:
        found = [m.content for m in log.messages(lambda topic: topic == "/estimate/0/linear")]
    k = np.nan_to_num(np.array([content["k"] for content in found], dtype=float).reshape(-1, 6))
    return [(one["cycle"], tuple(row)) for one, row in zip(found, np.round(k / scale).astype(int), strict=True)]


def test_network_and_receive_buffer_are_as_the_installed_files_say(facts):
    assert facts["mtu"] == 72
    assert facts["receive_buffer"] == 8 << 20


def test_daemon_runs_confined(facts, capsys):
    started = facts["started"]
    with capsys.disabled():
        print(f"\n{facts['exposure'].strip()}; {started['status']['VmRSS']} resident")
    assert started["User"] == "ema-daemon"
    assert started["status"]["Uid"].split()[0] != "0"
    assert float(re.search(r": ([\d.]+) ", facts["exposure"])[1]) <= 1.2
    assert int(started["status"]["VmRSS"].split()[0]) < 200_000


def test_estimates_reach_the_bus(facts):
    assert facts["first_estimates"] >= 2


def test_alarms_are_found_in_the_journal_by_their_message_id_with_fields_of_their_own(facts):
    names = ("EMA_ACTUATOR", "EMA_CAUSE", "EMA_LEVEL", "EMA_STATE", "_SYSTEMD_UNIT")
    found = [tuple(line[name] for name in names) for line in facts["alarms"] if line["EMA_CAUSE"] == "silent"]
    assert found[0] == ("0", "silent", "alarm", "active", "ema-daemon@vcan0.service")
    assert all(line["MESSAGE"].startswith("actuator 0: ") for line in facts["alarms"] if "EMA_ACTUATOR" in line)


def test_hf_worker_answers_over_its_socket(facts):
    assert facts["hf_estimates"] >= 1


@pytest.mark.parametrize(("event", "result"), [("killed", "signal"), ("hung", "watchdog")])
def test_daemon_is_restarted(facts, machine, event, result):
    before, after = facts[event]["before"], facts[event]["after"]
    assert after["MainPID"] != before["MainPID"]
    assert int(after["NRestarts"]) == int(before["NRestarts"]) + 1
    assert f"Failed with result '{result}'" in (machine / "journal.txt").read_text()


@pytest.mark.parametrize("event", ["kill", "hang", "interface", "key", "package", "upgrade"])
def test_estimates_go_on(facts, event):
    assert facts[f"estimates_after_{event}"] >= 2


def test_the_package_runs_its_own_program_and_goes_without_a_trace_of_itself(facts):
    assert facts["package_runs"][1].startswith("/usr/lib/ema-monitor/")
    assert facts["removed"]["left"] == []
    assert facts["removed"]["wanted"] == []


def test_a_removed_package_stopped_its_service_in_order(facts, machine):
    assert facts["removed"]["state"] == "inactive"
    with LogReader(segments(machine / "after_removal")[-1]) as log:
        assert log.unfinished == []


def test_a_removed_package_leaves_what_is_the_user_s(facts):
    assert facts["removed"]["mine"]
    assert facts["removed"]["logs"] >= 1


def test_the_package_has_no_error_by_lintian(machine):
    (deb,) = machine.glob("*.deb")
    words = ["lintian", "--fail-on", "error", "--allow-root", "--tag-display-limit", "3", deb]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-3000:]


def test_kill_opens_the_next_segment_and_loses_nothing_earlier(machine):
    before, after = machine / "before_kill", machine / "after_kill"
    (first,) = segments(before)
    assert len(segments(after)) == 2
    assert segments(after)[0].name == first.name
    assert (after / first.name).read_bytes().startswith(first.read_bytes())
    assert estimates(after)[: len(estimates(before))] == estimates(before)


def test_interface_gone_means_a_finished_log(facts, machine):
    assert facts["without_interface"] == {"ActiveState": "inactive", "Result": "success"}
    with LogReader(segments(machine / "without_interface")[-1]) as log:
        assert log.unfinished == []


def test_shutdown_finishes_the_log(machine):
    final = machine / "after_shutdown"
    with LogReader(final) as log:
        unfinished = [path.name for path in log.unfinished]
        assert log.damage == []
    # Killed and hung: each left its segment open, which the reader takes nevertheless.
    assert unfinished == [path.name for path in segments(final)][:2]
    with LogReader(segments(final)[-1]) as log:
        *_, last = log.messages(lambda topic: topic == "/event")
    assert last.content["code"] == "stopped"


def test_log_holds_what_the_bus_carried(machine, capsys):
    """All estimates candump has seen, but at most those of one flush interval before the kill and before the hang."""
    message = default().messages["EstimateLinear"]
    seen = []
    for line in (machine / "bus.log").read_text(errors="replace").splitlines():
        _, _, frame = line.split()
        identifier, _, data = frame.partition("##")
        if int(identifier, 16) == message.frame_id:
            one = fr.empty(1)
            payload = bytes.fromhex(data[1:])
            one["data"][0, : len(payload)] = np.frombuffer(payload, np.uint8)
            values = message.decode(one)
            k = np.round(values["k"][0] / message.fields["k"].scale).astype(int)
            seen.append((int(values["cycle"][0]), tuple(k)))
    logged = Counter(estimates(machine / "after_shutdown"))
    missing = list((Counter(seen) - logged).elements())
    with capsys.disabled():
        print(f"\nestimates on the bus {len(seen)}, of them not in the log {len(missing)}")
    assert len(seen) >= 8
    assert len(missing) <= 2
