"""Log into a folder that becomes read-only and is writable again; print what happened as one JSON line.

A kernel does not remount read-only what is open for writing, so another read-only file system is laid over the folder.
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

from ema.core import frames as raw
from ema.log import LogReader, LogSettings
from ema.log.segmented import SegmentedLog


def main(directory):
    log = SegmentedLog(directory, {}, LogSettings(keep_free=0), 10**18, 0.0)
    states, accepted = [], []
    for second in range(40):
        if second == 10:
            subprocess.run(["mount", "-t", "tmpfs", "-o", "ro", "none", directory], check=True)
        if second == 30:
            subprocess.run(["umount", "--lazy", directory], check=True)
        batch = raw.empty(200)
        batch["t_ns"] = 10**18 + second * 10**9 + np.arange(200)
        before = log.dropped
        log.frames(batch, "vcan0")
        if log.dropped == before:
            accepted.append(second)
        log.tick(10**18, second + 1.0)
        states.append(log.state.name)
    log.close()
    with LogReader(directory) as back:
        seconds = sorted({int(s) for b in back.frames() for s in (b.frames["t_ns"] - 10**18) // 10**9})
        codes = [m.content["code"] for m in back.messages(lambda topic: topic == "/event")]
        damage = [str(d) for d in back.damage]
    print(json.dumps({"states": states, "accepted": accepted, "logged": seconds, "damage": damage, "events": codes}))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
