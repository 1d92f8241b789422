"""Six actuators on one bus, one daemon process, no frame lost."""

import time

import pytest

from ema.bus.socketcan import SocketCanPort

NUMBERS = range(6)
CHUNK = 60


@pytest.fixture
def daemon(daemon_on_vcan0, tmp_path):
    return daemon_on_vcan0(tmp_path, NUMBERS)


def test_six_actuators_without_a_lost_frame(daemon, vcan0, fly, capsys):
    faults = [{f"k{number + 1}": 0.03} for number in NUMBERS]
    flight = fly(n_cycles=2, actuators=[{"number": n, "faults": f} for n, f in zip(NUMBERS, faults, strict=True)])
    n_frames, began, cpu = 0, time.monotonic(), daemon.cpu_time()
    with SocketCanPort(vcan0, filters=[]) as node:
        for _, frames in flight:
            for start in range(0, len(frames), CHUNK):
                assert node.write(frames[start : start + CHUNK]) == len(frames[start : start + CHUNK])
                time.sleep(0.005)
            n_frames += len(frames)
    took, cpu = time.monotonic() - began, daemon.cpu_time() - cpu
    beat = daemon.next("Heartbeat", lambda beat: beat["n_cycles"] == len(NUMBERS) * len(flight))
    assert beat["n_estimates"] == beat["n_cycles"]
    lost = ("n_lost", "n_repeated", "n_reordered", "n_crc_error", "n_wrong_counter", "n_wrong_length", "kernel_drops")
    assert {name: int(beat[name]) for name in lost} == dict.fromkeys(lost, 0)
    assert daemon.stop() == 0
    with capsys.disabled():
        print(f"\nsix actuators: {n_frames} frames in {took:.1f} s ({n_frames / took:.0f}/s), daemon {cpu:.2f} s CPU")
