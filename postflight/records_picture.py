"""Every channel of some records over time, at a glance."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np

from ema.core.errors import ConfigError
from ema.core.names import CHANNELS
from ema.core.records import Record

MOST = 4000  # points drawn of a channel


def draw(records: Sequence[Record], path: Path) -> None:
    """Write a picture: a row for each channel, a column for each record, cycles one behind the other."""
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    names = [name for name in CHANNELS if name != "t" and any(name in record.channels for record in records)]
    size = (max(6.4, 4.2 * len(records)), 0.6 + 1.25 * len(names))
    figure, axes = plt.subplots(
        len(names), len(records), figsize=size, sharex="col", squeeze=False, layout="constrained"
    )
    for column, record in zip(axes.T, records, strict=True):
        column[0].set_title(Path(record.name).name, fontsize=9, loc="left")
        for name, ax in zip(names, column, strict=True):
            begin = 0.0
            for cycle in record.cycles if name in record.channels else ():
                few = slice(None, None, max(1, cycle.n_samples // MOST))
                ax.plot(begin + cycle["t"][few], cycle[name][few], lw=0.7, color="#1f4e79")
                begin += float(np.ptp(cycle["t"])) + 2.0 * cycle.period
                ax.axvline(begin, color="#d7dde3", lw=0.6)
            ax.set_ylabel(f"{name}\n[{CHANNELS[name].unit}]", fontsize=8)
            ax.tick_params(labelsize=7)
        column[-1].set_xlabel("time, cycles one behind the other [s]", fontsize=8)
    try:
        figure.savefig(path, dpi=150)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be written ({error.strerror})") from error
    finally:
        plt.close(figure)
