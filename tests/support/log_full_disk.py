"""Log onto a file system that another file fills and leaves again; print what happened as one JSON line."""

import json
import sys
from pathlib import Path

import numpy as np

from ema.core import frames as raw
from ema.log import LogReader, LogSettings
from ema.log.segmented import SegmentedLog


def main(directory):
    rng = np.random.default_rng(1)
    log = SegmentedLog(directory, {}, LogSettings(keep_free=0, segment_size=0.3), 10**18, 0.0)
    ballast = directory / "ballast"
    states, accepted = [], []
    for second in range(60):
        if second == 10:
            with ballast.open("wb", buffering=0) as file:
                try:
                    while True:
                        file.write(bytes(10_000))
                except OSError:
                    pass
        if second == 30:
            ballast.unlink()
        batch = raw.empty(200)
        batch["t_ns"] = 10**18 + second * 10**9 + np.arange(200)
        batch["data"] = rng.integers(0, 256, (200, 64))
        before = log.dropped
        log.frames(batch, "vcan0")
        if log.dropped == before:
            accepted.append(second)
        log.tick(10**18, second + 1.0)
        states.append(log.state.name)
    log.close()
    with LogReader(directory) as back:
        seconds = sorted({int(s) for b in back.frames() for s in (b.frames["t_ns"] - 10**18) // 10**9})
        print(json.dumps({"states": states, "accepted": accepted, "logged": seconds, "damage": len(back.damage)}))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
