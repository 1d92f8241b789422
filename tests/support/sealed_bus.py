"""A sender with seals and a receiver that knows it, for tests."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ema.bus.codec import Codec
from ema.bus.keys import Keyring
from ema.bus.sealer import Sealer
from ema.bus.sessions import Sessions
from ema.bus.verifier import Verifier

RING = Keyring({None: [b"\x5a" * 16]})


def acquainted(codec: Codec, frames: np.ndarray, folder: Path) -> tuple[Sealer, Verifier]:
    """Both ends, after the receiver has asked the senders of `frames` for their sessions."""
    sealer, verifier = Sealer(codec, RING, Sessions(folder / "session")), Verifier(codec, RING)
    verifier.feed(sealer.add(frames), 0)
    verifier.feed(sealer.hear(verifier.ask(0), 0), 0)
    return sealer, verifier
