from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from ema.core import frames as fr
from ema.monitor.track import Track


def numbered(numbers):
    frames = fr.empty(len(numbers))
    numbers = np.asarray(numbers) % 65536
    frames["data"][:, 2], frames["data"][:, 3] = numbers % 256, numbers // 256
    frames["t_ns"] = np.arange(len(numbers))
    return frames


def numbers_of(frames):
    return frames["data"][:, 2] + 256 * frames["data"][:, 3].astype(int)


@given(
    first=st.integers(0, 65535),
    lost=st.sets(st.integers(0, 99)),
    cuts=st.lists(st.integers(0, 100), max_size=4),
    swap=st.integers(0, 98),
)
def test_frames_find_their_places_however_they_come(first, lost, cuts, swap):
    sent = np.array([n for n in range(100) if n not in lost], int)
    if swap + 1 < sent.size:
        sent[[swap, swap + 1]] = sent[[swap + 1, swap]]
    track = Track(100)
    for part in np.split(numbered(first + sent), sorted(min(c, sent.size) for c in cuts)):
        track.put(part)
    frames, present = track.take(first, 100)
    assert np.flatnonzero(~present).tolist() == sorted(lost)
    assert np.array_equal(numbers_of(frames[present]), (first + np.flatnonzero(present)) % 65536)
    assert not frames[~present]["data"].any()


def test_frames_are_taken_once():
    track = Track(10)
    track.put(numbered(range(10)))
    assert track.take(0, 10)[1].all()
    assert not track.take(0, 10)[1].any()


def test_older_laps_of_the_sequence_number_are_not_mistaken_for_this_one():
    track = Track(10)
    track.put(numbered(range(5)))
    track.put(numbered(range(200, 210)))
    track.put(numbered([65500]))
    track.put(numbered(range(5, 10)))  # 65536 later
    assert np.flatnonzero(track.take(0, 10)[1]).tolist() == [5, 6, 7, 8, 9]


def test_it_knows_the_newest_frame_of_a_number():
    track = Track(10)
    track.put(numbered(range(65530, 65540)))
    assert track.has(3)
    assert track.has(65530)
    assert not track.has(4)
    assert not track.has(65529)
