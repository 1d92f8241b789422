"""Somebody who knows the DBC forges currents with the right CRC and number: with a key, no estimate changes."""

import numpy as np
import pytest
from e2e.p05 import e2e_p05_protect

from ema.bus import codec as codecs
from ema.bus import identifiers
from ema.bus.authentication import Sealer, Verifier
from ema.bus.header import sequence
from ema.core import frames as fr
from ema.monitor import Identified, Monitor
from ema.monitor.settings import MonitorSettings

CODEC = codecs.default()
KEY = b"\x5a" * 16
CURRENTS = CODEC.messages["PhaseCurrents"].frame_id


@pytest.fixture
def estimates(coarse_bundle):
    def of(frames):
        monitor = Monitor({0: coarse_bundle}, CODEC, MonitorSettings.model_validate({"slower": {}}))
        outputs = [*monitor.update(frames), *monitor.finish()]
        return np.array([o.estimate.k for o in outputs if isinstance(o, Identified)])

    return of


def with_forged(frames):
    """Before every tenth frame of currents, another one in its place: all currents half as large."""
    out = []
    for n in range(frames.size):
        frame = frames[n : n + 1]
        if frame["id"][0] == CURRENTS and sequence(frame)[0] % 10 == 0:
            forged = frame.copy()
            forged["data"][0, 4:] = (frame["data"][0, 4:].copy().view(">i2") // 2).view(np.uint8)
            payload = forged["data"][0, :64].copy()
            e2e_p05_protect(payload.data, identifiers.data_id(CURRENTS), increment_counter=False)
            forged["data"][0] = payload
            out.append(forged)
        out.append(frame)
    return np.concatenate(out)


def with_seals(frames):
    sealer, out = Sealer(CODEC, KEY), []
    for n in range(frames.size):
        seals = sealer.add(frames[n : n + 1], int(frames["t_ns"][n]))
        seals["t_ns"] = frames["t_ns"][n]
        out += [frames[n : n + 1], seals]
    return np.concatenate(out)


def let_through(frames):
    verifier = Verifier(CODEC, KEY)
    parts = [verifier.feed(part, int(part["t_ns"][-1])) for part in np.array_split(frames, 200)]
    return np.concatenate([*parts, verifier.feed(fr.empty(0), 2**63)]), verifier.n_refused


def test_forged_currents_change_no_estimate(frames, estimates):
    true = estimates(frames)
    passed, n_refused = let_through(with_forged(with_seals(frames)))
    assert n_refused == with_forged(frames).size - frames.size > 250
    assert np.array_equal(estimates(passed), true)


def test_without_a_key_they_do(frames, estimates):
    """Or the test above would show nothing."""
    assert not np.allclose(estimates(with_forged(frames)), estimates(frames), atol=0.01)
