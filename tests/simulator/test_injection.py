import numpy as np
import pytest
from ema_simulator.injection import FaultSource
from ema_simulator.scenario import load

from ema.bus.interface import open_bus, parse
from ema.bus.protection import Sender

TARGET = [0.1, 0.0, 0.3, 0.0, 0.0, 0.0]


@pytest.fixture
def source(write, codec):
    def make(allowed: str):
        scenario, _ = load(write(f"allow_injection: {allowed}\nactuators: [{{number: 2, faults: {{k1: 0.05}}}}]"))
        return FaultSource(scenario, codec)

    return make


def control(codec, actuator, k, ramp_time):
    return Sender().protect(codec.encode("SimulatorControl", actuator, {"k": np.array(k), "ramp_time": ramp_time}))


def test_an_allowed_injection_ramps_from_where_the_faults_are(source, codec):
    faults = source("true")
    faults.listen(control(codec, 2, TARGET, 10.0), t=100.0)
    assert faults.at(100.0)[0] == pytest.approx([0.05, 0, 0, 0, 0, 0])
    assert faults.at(105.0)[0] == pytest.approx([0.075, 0, 0.15, 0, 0, 0])
    assert faults.at(200.0)[0] == pytest.approx(TARGET)
    assert faults.n_injections == 1


def test_where_the_scenario_does_not_allow_it_nothing_happens(source, codec):
    faults = source("false")
    faults.listen(control(codec, 2, TARGET, 0.0), t=1.0)
    assert faults.at(2.0)[0] == pytest.approx([0.05, 0, 0, 0, 0, 0])
    assert faults.n_injections == 0


def test_damaged_foreign_and_repeated_frames_are_not_obeyed(source, codec):
    faults = source("true")
    damaged = control(codec, 2, TARGET, 0.0)
    damaged["data"][0, 5] ^= 1
    faults.listen(damaged, t=1.0)
    faults.listen(control(codec, 3, TARGET, 0.0), t=1.0)
    assert faults.n_injections == 0
    for _ in range(3):
        faults.listen(control(codec, 2, TARGET, 0.0), t=1.0)
    assert faults.n_injections == 1


def test_on_a_bus_with_a_key_only_sealed_injections_are_obeyed(source, codec, tmp_path):
    key = tmp_path / "key"
    key.write_text("5a" * 16)
    key.chmod(0o600)
    place = parse("virtual:injection")
    locked, faults = place.model_copy(update={"key_file": key}), source("true")
    filters = codec.filters("Tester")
    with open_bus(locked, filters, "Actuator") as node, open_bus(place) as stranger, open_bus(locked) as tester:

        def listen():
            for _ in range(15):  # longer than a frame waits for its seal
                faults.listen(node.read(0.01), t=1.0)

        stranger.write(control(codec, 2, TARGET, 0.0))
        listen()
        assert (faults.n_injections, faults.n_refused) == (0, 1)
        out = Sender()
        tester.write(out.protect(control(codec, 2, TARGET, 0.0)))
        listen()  # does not know the tester, and asks
        tester.read(0.1)
        assert (faults.n_injections, faults.n_refused, tester.n_answers) == (0, 2, 1)
        tester.write(out.protect(control(codec, 2, TARGET, 0.0)))
        listen()
        assert (faults.n_injections, faults.n_refused) == (1, 2)
        assert faults.at(2.0)[0] == pytest.approx(TARGET)
