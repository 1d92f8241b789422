"""The picture: each fault over the cycles, true and estimated."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ema.core.names import FAULT_MEANING, FAULTS

from .results import Flight

_STYLE = {
    "linear": {"marker": "o", "ms": 3, "color": "tab:blue"},
    "lf2": {"marker": "D", "ms": 4, "color": "tab:orange"},
}


def write(path: Path, flight: Flight) -> None:
    """Write the picture as PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 5.5), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, 3, sharex=True, sharey=True)
    for n, (name, ax) in enumerate(zip(FAULTS, axes.flat, strict=True)):
        ax.plot(flight.cycle, flight.k[:, n], color="black", lw=1.5, label="true")
        for method, style in _STYLE.items():
            seen = [e for e in flight.estimates[method].values() if e["k"][n] is not None]
            cycles = np.array([e["cycle"] for e in seen])
            k, sd = (np.array([e[key][n] for e in seen]) for key in ("k", "sd"))
            ax.errorbar(cycles, k, yerr=2 * sd, ls="none", elinewidth=0.8, label=f"{method} ± 2 sd", **style)
        ax.set_title(f"{name}: {FAULT_MEANING[name]}", fontsize=10)
        ax.grid(alpha=0.3)
    axes[0, 0].legend(fontsize=8, loc="upper left")
    for ax in axes[1]:
        ax.set_xlabel("test cycle")
    for ax in axes[:, 0]:
        ax.set_ylabel("fault [1]")
    figure.savefig(path, dpi=130)
