"""Whatever is on the bus: no crash, bounded memory, and the actuator's own cycles are still found."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ema.bus import codec as codecs
from ema.bus.protection import Sender
from ema.core import frames as fr
from ema.monitor import Identified

CODEC = codecs.default()
ids = st.one_of(
    st.integers(0, 2**32 - 1),
    st.sampled_from([m.frame_id | a << 2 for m in CODEC.messages.values() for a in (0, 1)]),
)


@st.composite
def raw_frames(draw):
    n = draw(st.integers(0, 40))
    frames = fr.empty(n)
    frames["t_ns"] = draw(arrays(np.uint64, n, elements=st.integers(0, 2**63 - 1)))
    frames["id"] = draw(arrays(np.uint32, n, elements=ids))
    frames["flags"] = draw(arrays(np.uint8, n))
    frames["length"] = draw(arrays(np.uint8, n, elements=st.integers(0, 64)))
    frames["data"] = draw(arrays(np.uint8, (n, 64)))
    return frames


@st.composite
def sealed_frames(draw):
    """Frames with a right CRC and a running sequence, and anything at all in them."""
    sender = Sender()
    frames = draw(raw_frames())
    names = draw(
        st.lists(st.sampled_from(["CycleStart", "CycleEnd", "PhaseCurrents", "Motion", "Supply"]), max_size=40)
    )
    frames = frames[: len(names)]
    for frame, name in zip(frames, names, strict=False):
        message = CODEC.messages[name]
        frame["id"], frame["length"], frame["flags"] = message.frame_id, message.length, 9
        if draw(st.booleans()):
            sender.skip(message.frame_id, draw(st.integers(0, 65535)))
    return sender.protect(np.ascontiguousarray(frames))


@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(batches=st.lists(st.one_of(raw_frames(), sealed_frames()), max_size=6))
def test_arbitrary_frames_never_crash_it(bench, batches):
    monitor = bench.monitor(0, 1)
    for batch in batches:
        monitor.update(batch)
    monitor.finish()


@pytest.mark.parametrize("seed", range(3))
def test_among_noise_the_cycles_are_found(bench, fly, growing, seed):
    frames = np.concatenate([f for _, f in fly(**growing)])
    rng = np.random.default_rng(seed)
    noise = fr.empty(3000)
    noise["id"] = np.where(rng.random(3000) < 0.5, rng.choice(frames["id"], 3000), rng.integers(0, 1 << 29, 3000))
    noise["flags"] = rng.choice([1, 9, 2, 4, 13], 3000)
    noise["length"] = rng.integers(0, 65, 3000)
    noise["data"] = rng.integers(0, 256, (3000, 64))
    places = rng.integers(0, frames.size, 3000)
    noise["t_ns"] = frames["t_ns"][places]
    mixed = bench.outputs(np.insert(frames, places, noise))
    own = [o.estimate.k for o in mixed if isinstance(o, Identified) and o.estimate.method == "linear"]
    assert np.array_equal(own, [o.estimate.k for o in bench.linear(frames)])
