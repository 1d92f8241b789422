"""The cycles that an event names, out of records, for `ema discrepancy`."""

from __future__ import annotations

import json

import numpy as np
import pytest
from ema_postflight.discrepancy import _chosen, _left_out, _read

from ema.core.errors import ConfigError, LogError, NoCycleError, RecordError
from ema.core.records import Cycle, Record
from ema.log import LogSettings, LogWriter


@pytest.fixture
def records():
    """Two segments of a log."""
    return [Record(tuple(Cycle(n, {"t": np.arange(3.0)}) for n in numbers)) for numbers in (range(5), range(5, 9))]


def numbers(records):
    return [[cycle.number for cycle in record] for record in records]


def test_they_are_taken_from_where_they_are(records):
    assert numbers(_chosen(records, "3,6,8")) == [[3], [6, 8]]
    assert numbers(_chosen(records, "6")) == [[6]]
    assert _chosen(records, None) == records


def test_one_that_is_not_there_is_told(records):
    with pytest.raises(RecordError, match=r"cycle 12 is not in the records \(there are 9 whole ones: 0 … 8\)"):
        _chosen(records, "3,12")
    with pytest.raises(ConfigError, match="--cycles 3;4: must be cycle numbers with commas"):
        _chosen(records, "3;4")


def test_what_was_left_out_for_its_gaps_is_told(records):
    records.append(Record(tuple(Cycle(n, {"t": np.arange(3.0)}) for n in (9, 11)), broken=(10,)))
    with pytest.raises(RecordError, match="cycle 10 was left out: frames of it are missing"):
        _chosen(records, "3,10")
    assert _left_out(records, None) == ["record: 1 of 3 cycles have gaps and were left out"]
    assert _left_out(_chosen(records, "3,9"), "3,9") == []


def log(directory, flight, bundle):
    """A finished segment with the frames of a flight."""
    with LogWriter(directory, {"manifest.json": json.dumps(bundle.manifest).encode()}, LogSettings(keep_free=0)) as out:
        for _, frames in flight:
            out.frames(frames, "vcan0")


def test_a_record_given_twice_is_refused(fly, coarse_bundle, tmp_path):
    """On its own and in its folder it would be taken as two that agree."""
    log(tmp_path, fly(n_cycles=2, seed=4), coarse_bundle)
    (segment,) = tmp_path.glob("*.mcap")
    with pytest.raises(RecordError, match=r"\.mcap: is given twice \(a folder stands for every log in it\)"):
        _read([tmp_path, segment])
    with pytest.raises(RecordError, match="is given twice"):
        _read([segment, segment])
    copy = tmp_path / "elsewhere.mcap"
    copy.write_bytes(segment.read_bytes())
    with pytest.raises(RecordError, match=r"elsewhere\.mcap: is given twice: .* holds the same, byte for byte"):
        _read([segment, copy])
    assert len(_read([segment])[0]) == 1


def test_a_directory_stands_for_the_logs_in_it_and_one_without_a_cycle_is_left_out(fly, coarse_bundle, tmp_path):
    with pytest.raises(LogError, match="holds no log"):
        _read([tmp_path])
    log(tmp_path, [], coarse_bundle)
    with pytest.raises(NoCycleError, match="no cycle without a gap"):
        _read([tmp_path])
    log(tmp_path, fly(n_cycles=2, seed=4), coarse_bundle)
    (record,), (told,) = _read([tmp_path])
    assert record.n_cycles == 2
    assert told.endswith("no cycle without a gap in it")
