"""`ema simulate` on the kernel's CAN, with can-utils and cantools as witnesses that share no code with the project."""

import csv
import re
import subprocess
import sys
from pathlib import Path

import cantools
import numpy as np
import pytest

from ema.core import resources

BIN = Path(sys.executable).parent
N_FRAMES = 1 + 501 + 51 + 1 + 10  # one cycle of one actuator
SCENARIO = "n_cycles: 1\nseed: 4\nactuators: [{number: 9, faults: {k3: 0.1}}]\n"


@pytest.fixture
def scenario(tmp_path):
    path = tmp_path / "scenario.yaml"
    path.write_text(SCENARIO)
    return path


def simulate(*words):
    return subprocess.run([BIN / "ema", "simulate", *map(str, words)], check=True, timeout=300)


def test_a_cycle_on_the_bus_is_the_record(scenario, vcan0, candump, tmp_path):
    simulate("--scenario", scenario, "--csv", tmp_path / "x.csv")
    dump = candump(N_FRAMES)
    simulate("--scenario", scenario, "--bus", vcan0, "--rate", 0.5)
    database = cantools.database.load_file(resources.dbc(), frame_id_mask=0x1FFFFF03)
    currents = []
    for line in dump():
        _time, _interface, frame = line.split()
        identifier, _, data = frame.partition("##")
        message = database.get_message_by_frame_id(int(identifier, 16))
        if message.name == "PhaseCurrents":
            values = message.decode(bytes.fromhex(data[1:]))
            currents += [[values[f"i_{phase}_{n}"] for phase in "abc"] for n in range(10)]
    with open(tmp_path / "x.csv") as file:
        rows = [[float(row[f"i_{phase} [A]"]) for phase in "abc"] for row in csv.DictReader(file)]
    assert np.array_equal(np.array(currents)[: len(rows)], rows)


def test_cantools_own_program_reads_the_bus(scenario, vcan0, candump):
    dump = candump(N_FRAMES)
    simulate("--scenario", scenario, "--bus", vcan0, "--rate", 0.5)
    words = [BIN / "cantools", "decode", "--frame-id-mask", "0x1FFFFF03", "--single-line", resources.dbc()]
    decoded = subprocess.run(words, input="\n".join(dump()), capture_output=True, text=True, check=True).stdout
    names = re.findall(r":: (\w+)\(", decoded)
    assert {name: names.count(name) for name in set(names)} == {
        "CycleStart": 1,
        "PhaseCurrents": 501,
        "Motion": 51,
        "CycleEnd": 1,
        "Supply": 10,
    }
