import numpy as np
import pytest

from ema.core import frames


def test_the_layout_is_packed_and_survives_a_round_trip():
    assert frames.FRAME_DTYPE.itemsize == 8 + 4 + 1 + 1 + 64
    batch = frames.empty(3)
    batch["t_ns"] = 2**63 + 1
    batch["id"] = [0, 0x7FF, 0x1FFFFFFF]
    batch["flags"] = int(frames.FrameFlag.FD | frames.FrameFlag.EXTENDED)
    batch["length"] = 64
    batch["data"] = np.arange(64)
    assert np.array_equal(frames.unpack(frames.pack(batch[::2])), batch[::2])


def test_bytes_that_are_no_whole_frames_are_refused():
    with pytest.raises(ValueError, match="multiple"):
        frames.unpack(b"\0" * 77)
