"""The cycles that an event names, out of records, for `ema discrepancy`."""

from __future__ import annotations

import numpy as np
import pytest
from ema_postflight.discrepancy import _chosen, _left_out

from ema.core.errors import ConfigError, RecordError
from ema.core.records import Cycle, Record


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
