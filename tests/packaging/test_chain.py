"""The whole chain by its commands: records of other code, cause, extended plant, and every command on that.

A weaker magnet is hidden; it is named, stands in the plant file, and from there in the bundle, the simulator, the
monitor, its log and the report.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys

import numpy as np
import pytest
import yaml
from ema_offline_builder.config import Builder
from ema_offline_builder.nuisance import resolve
from hidden_traffic import watched

from ema import bundle as bundles
from ema.core import config, resources
from ema.core.csv_records import write_csv
from ema.core.records import Cycle, Record
from ema.log import LogReader
from ema.models.actuator import Actuator

FLUX, K = -0.06, np.array([0.03, 0.0, 0.0, 0.0, 0.0, 0.0])
N_FLOWN = 5
EMA = ("-c", "from ema.cli import main; main()")

pytestmark = pytest.mark.slow


def ema(*words, program=EMA, statuses=(0,)) -> str:
    """A command in a process of its own, as its users run it."""
    command = [sys.executable, *program, *map(str, words)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=500)
    assert run.returncode in statuses, run.stderr[-1500:]
    return run.stdout


@pytest.fixture(scope="module")
def folder(hidden, coarse_bundle, tmp_path_factory):
    """Recorded flight (flight.csv), findings of it (found) and the bundle of the extended plant (bundle)."""
    folder = tmp_path_factory.mktemp("chain")
    cycles = hidden.cycles(hidden.Flaws(flux=FLUX, k1=K[0]), 3, 1, motions=(hidden.chirp(),))
    write_csv(Record(tuple(Cycle(n, channels) for n, channels in enumerate(cycles))), folder / "flight.csv")
    plant = resources.config("actuator.yaml")
    ema("discrepancy", folder / "flight.csv", "--plant", plant, "--out", folder / "found")
    builder = coarse_bundle.manifest["builder"] | {"plant": "found/extended.yaml"}
    (folder / "builder.yaml").write_text(yaml.safe_dump(builder))
    ema("build", "--config", folder / "builder.yaml", "--out", folder / "bundle", "--workers", 2)
    return folder


@pytest.fixture(scope="module")
def flown(folder):
    """The same after the daemon has monitored the extended plant's simulation (log), on the bus within a process."""
    bus = {"interface": "virtual", "channel": "chain"}
    scenario = {
        "actuator": "found/extended.yaml", "bus": bus, "n_cycles": N_FLOWN, "rate": 4, "seed": 3,
        "actuators": [{"faults": {"k1": float(K[0])}}],
    }  # fmt: skip
    daemon = {
        "bus": bus, "actuators": {0: {"bundle": "bundle", "plant": "found/extended.yaml"}},
        "log": {"directory": "log"}, "monitor": {"slower": {"lf2": {"every": "0.1 s"}}},
    }  # fmt: skip
    for name, content in (("scenario", scenario), ("daemon", daemon)):
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(content))
    (folder / "log").mkdir()
    words = ("daemon", "--config", folder / "daemon.yaml", "--", "simulate", "--scenario", folder / "scenario.yaml")
    ema(*words, program=("-m", "ema_demo.together"))
    return folder


def err_k(answer: str) -> float:
    cycles = json.loads(answer)["records"][0]["cycles"]
    return float(np.mean([np.linalg.norm(np.array(c["k"]) - K) for c in cycles]) / np.sqrt(6.0))


@pytest.fixture(scope="module")
def before(folder, coarse_bundle):
    """Error of the linear estimates with the plain plant's bundle: a weaker magnet is three shorts."""
    words = ("identify", "--method", "linear", folder / "flight.csv", "--bundle", coarse_bundle.path, "--json")
    return err_k(ema(*words))


def test_magnet_flux_is_named_from_a_file_and_extends_the_plant(folder):
    """A weaker magnet reads as three shorted phases until it is named beside them; `extended.yaml` then holds it.

    Of three cycles it hangs on the noise whether the shorts leave more than chance: they are in its set, or rejected.
    """
    out = folder / "found"
    findings = json.loads((out / "findings.json").read_text())
    assert findings["verdict"] == "explained"
    assert [e["name"] for e in findings["effects"]] == ["magnet_flux"]
    rivals = findings["effects"][0]["indistinguishable_from"]
    assert rivals in ([], ["k3 and k4 and k5 alike"])
    assert findings["posterior"][0]["effects"] == ["magnet_flux"]
    assert findings["effects"][0]["parameters"]["change"]["value"] == pytest.approx(FLUX, abs=0.004)
    assert min(findings["gain"]["k_before"][2:5]) > 0.04
    assert max(findings["gain"]["k_after"][1:]) < 0.02
    extended = config.load(out / "extended.yaml", Actuator)
    assert extended.effects["magnet_flux"]["change"] == pytest.approx(FLUX, abs=0.004)
    low, high = extended.intervals["magnet_flux"]["change"]
    assert low < extended.effects["magnet_flux"]["change"] < high
    assert yaml.safe_load((out / "extended.yaml").read_text())["kind"] == "ema"
    report = (out / "report.html").read_text()
    assert ("One of 2 that fit alike" in report) == bool(rivals)
    assert "magnet flux changed by -6.0%" in report.lower()
    assert "http" not in report.replace("http-equiv", "")


@pytest.mark.parametrize("method", ["linear", "lf2", "lf1", "hf"])
def test_estimates_become_better(folder, before, method):
    after = err_k(ema("identify", "--method", method, folder / "flight.csv", "--bundle", folder / "bundle", "--json"))
    print(f"{method}: err_k {before:.4f} -> {after:.4f}")
    assert after < 0.25 * before


def test_what_was_found_can_be_carried_beside_the_faults_as_sure_as_it_was_found(folder, coarse_bundle):
    carried = [{"parameter": "magnet_flux.change", "sd": "interval"}]
    builder = Builder.model_validate(coarse_bundle.manifest["builder"] | {"nuisance": carried})
    plant = config.load(folder / "found/extended.yaml", Actuator)
    nuisance, (low, high) = resolve(builder, plant), plant.intervals["magnet_flux"]["change"]
    assert nuisance.centre == pytest.approx([FLUX], abs=0.002)
    assert nuisance.sd == pytest.approx([(high - low) / 3.92])
    assert low <= nuisance.centre[0] <= high


def test_false_alarms_end(folder, coarse_bundle, hidden):
    """The monitor on the bundle of the plain plant and on that of the extended one, the same flight."""
    cycles = hidden.cycles(hidden.Flaws(flux=FLUX, k1=K[0]), 6, 17, motions=(hidden.chirp(),))
    before, after = (watched(b, cycles).alarms(K) for b in (coarse_bundle, bundles.load(folder / "bundle")))
    print(f"false alarms: {', '.join(before)} -> {', '.join(after) or 'none'}")
    assert before == ["k3", "k4", "k5"]
    assert after == []


def test_nothing_more_is_found_on_the_extended_plant(folder):
    words = ("discrepancy", folder / "flight.csv", "--plant", folder / "found/extended.yaml")
    found = json.loads(ema(*words, "--out", folder / "again", "--json"))
    assert found["verdict"] == "adequate"
    assert found["gain"]["k_before"] == pytest.approx(K, abs=0.006)
    plants = [yaml.safe_load((folder / name / "extended.yaml").read_text()) for name in ("found", "again")]
    assert plants[0] == plants[1]


def test_the_simulator_makes_records_of_the_extended_plant(flown, coarse_bundle):
    ema("simulate", "--scenario", flown / "scenario.yaml", "--csv", flown / "simulated.csv")
    words = ("identify", "--method", "linear", flown / "simulated.csv", "--json", "--bundle")
    assert err_k(ema(*words, coarse_bundle.path)) > 0.03
    assert err_k(ema(*words, flown / "bundle")) < 0.01


def test_the_daemon_monitors_it_without_doubt(flown):
    with LogReader(flown / "log") as log:
        messages = list(log.messages())
    estimates = [m.content for m in messages if m.topic in ("/estimate/0/linear", "/estimate/0/lf2")]
    assert len(estimates) == 2 * N_FLOWN
    for estimate in estimates:
        assert estimate["k"] == pytest.approx(K, abs=0.03)
        assert "model_in_doubt" not in estimate["reasons"]


def test_replay_gives_the_same_estimates(flown):
    answer = json.loads(ema("replay", flown / "log", "--identify", "--json"))
    assert answer["same_bundle"]
    assert (answer["n_different"], answer["n_equal"]) == (0, 2 * N_FLOWN)


def test_the_report_says_what_the_plant_was_extended_with(flown):
    ema("report", flown / "log", "--out", flown / "report.html")
    assert "extended: magnet flux changed by -6.0%" in (flown / "report.html").read_text()


def test_the_doctor_finds_the_bundle_sound(flown):
    answer = ema("doctor", "--config", flown / "daemon.yaml", "--bus", "virtual", "--json", statuses=(0, 1))
    found = {one["what"]: one for one in json.loads(answer.partition("\nema: ")[0])}
    assert found["bundles"]["verdict"] == found["configuration"]["verdict"] == "ok"
    assert re.search(r"extended: magnet_flux change = -0\.0(59|60)", found["bundles"]["found"])
