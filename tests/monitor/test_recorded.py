"""A daemon's log as a record."""

import json

import numpy as np
import pytest

from ema.core.errors import RecordError
from ema.core.records import read_record
from ema.identification import identifier
from ema.identification.recorded import measurements
from ema.log import LogReader, LogSettings, LogWriter
from ema.monitor.recorded import cycles


def _log(directory, flight, bundle, **attached):
    directory.mkdir()
    attachments = {"manifest.json": json.dumps(bundle.manifest).encode(), **attached}
    with LogWriter(directory, attachments, LogSettings(keep_free=0)) as log:
        for _, frames in flight:
            log.frames(frames, "vcan0")
    return next(directory.glob("*.mcap"))


def test_the_record_is_what_the_actuator_did_and_identifies_as_on_the_bus(fly, bench, coarse_bundle, tmp_path):
    flight = fly(n_cycles=3, seed=4, actuators=[{"number": 5, "faults": {"k1": 0.1}}])
    record = read_record(_log(tmp_path / "log", flight, coarse_bundle))
    assert record.n_cycles == 3
    live = bench.linear(flight, 5)
    linear = identifier("linear", coarse_bundle)
    for measured, out in zip(measurements(record, coarse_bundle.plant, coarse_bundle.schedule), live, strict=True):
        assert np.allclose(linear.estimate(measured).k, out.estimate.k, atol=1e-9)
    for name in ("theta_u", "theta_m", "theta_cmd", "u_dc", "temp_w"):
        assert name in record.channels


def test_several_actuators_are_taken_apart(fly, coarse_bundle, tmp_path):
    flight = fly(n_cycles=2, seed=4, actuators=[{"number": 0}, {"number": 9}])
    path = _log(tmp_path / "log", flight, coarse_bundle)
    with LogReader(path) as log:
        assert sorted((number, cycle.number) for number, cycle in cycles(log)) == [(0, 0), (0, 1), (9, 0), (9, 1)]
    with pytest.raises(RecordError, match=r"holds actuators 0 and 9.*--what cycles"):
        read_record(path)


def test_a_cycle_with_a_gap_is_left_out(fly, coarse_bundle, tmp_path):
    flight = fly(n_cycles=3, seed=4)
    currents = flight[1][1]
    flight[1] = (flight[1][0], np.delete(currents, 100))
    record = read_record(_log(tmp_path / "log", flight, coarse_bundle))
    assert [cycle.number for cycle in record] == [0, 2]
    assert record.broken == (1,)


def test_a_supply_frame_that_is_not_whole_is_not_heard(fly, bench, coarse_bundle, tmp_path):
    flight = fly(n_cycles=2, seed=4)
    spoilt = []
    for truth, frames in flight:
        places = bench.places(frames, "Supply")
        bad = frames[places]
        bad["data"][:, 4:] ^= 0x15  # behind the header
        spoilt.append((truth, np.insert(frames, places + 1, bad)))
    clean, heard = (read_record(_log(tmp_path / n, f, coarse_bundle)) for n, f in (("clean", flight), ("bad", spoilt)))
    for one, other in zip(clean, heard, strict=True):
        for name in ("u_dc", "temp_w"):
            assert np.array_equal(one.channels[name], other.channels[name])


def test_cycles_end_where_the_daemons_configuration_says(fly, coarse_bundle, tmp_path):
    flight = fly(n_cycles=3, seed=4)
    flight[1][1]["t_ns"][100:] += np.uint64(400_000_000)
    flight[2][1]["t_ns"] += np.uint64(400_000_000)
    patient = b"actuators: {0: {bundle: b}}\nmonitor: {timeout: 0.45}"
    for name, attached, whole in (("default", {}, [0, 2]), ("patient", {"daemon.yaml": patient}, [0, 1, 2])):
        record = read_record(_log(tmp_path / name, flight, coarse_bundle, **attached))
        assert [cycle.number for cycle in record] == whole


def test_what_contradicts_itself_is_said_with_the_record(fly, coarse_bundle, tmp_path):
    path = _log(tmp_path / "log", fly(n_cycles=2, seed=4), coarse_bundle)
    assert read_record(path).complaints == ()
    data = bytearray(path.read_bytes())
    data[-30] ^= 1  # in the footer
    path.write_bytes(data)
    record = read_record(path)
    assert record.n_cycles == 2
    assert len(record.complaints) == 1
    assert str(path) in record.complaints[0]


def test_a_log_that_does_not_say_whose_cycles_is_refused(fly, tmp_path):
    with LogWriter(tmp_path, {}, LogSettings(keep_free=0)) as log:
        log.frames(fly(n_cycles=3, seed=4)[0][1], "vcan0")
    with pytest.raises(RecordError, match="names no bundle"):
        read_record(next(tmp_path.glob("*.mcap")))
