"""Figures of `ema reproduce`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ema.bundle import Bundle

from .experiments import METHODS, SETS


def draw(out: Path, bundle: Bundle, results: dict[str, Any]) -> None:
    """Write all figures as PNG into `out`."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.ticker import LogLocator

    plt.rcParams.update({"figure.dpi": 90, "font.size": 9, "axes.spines.top": False, "axes.spines.right": False})

    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3), layout="constrained", width_ratios=(2, 1))
    v1 = bundle.arrays["v1"]
    left.plot(bundle.t, v1, lw=0.8)
    left.plot(bundle.t[bundle.schedule], v1[bundle.schedule], "o", ms=4)
    left.set(xlabel="t [s]", ylabel="v₁", title="Figure 1: sampling points on the first POD mode")
    share = bundle.arrays["eigenvalue_share"]
    right.semilogy(range(1, len(share) + 1), share, "o-")
    right.set(xlabel="mode", ylabel="share of Σλ", title=f"POD spectrum, λ₁ share {share[0]:.4f}")
    figure.savefig(out / "figure1.png")

    figure, axes = plt.subplots(1, 2, figsize=(9, 4), layout="constrained", sharey=True)
    for axis, quantity in zip(axes, ("err_k", "err_i"), strict=True):
        for j, name in enumerate(SETS):
            data = [results[f"identifier {m}"][name][quantity] for m in METHODS]
            places = [i + 0.3 * j for i in range(len(METHODS))]
            boxes = axis.boxplot(data, positions=places, widths=0.25, patch_artist=True, sym=".", manage_ticks=False,
                                 medianprops={"color": "black", "lw": 1.5})  # fmt: skip
            for box in boxes["boxes"]:
                box.set_facecolor(f"C{j}")
            if quantity == "err_k":
                axis.axhline(results["identifier linear"][name]["null"], color=f"C{j}", ls=":", lw=1)
            axis.plot([], [], "s", color=f"C{j}", label=f"{name}: U(0, {SETS[name]:g})")
        axis.set_yscale("log")
        axis.set_xticks([i + 0.15 for i in range(len(METHODS))], METHODS, rotation=30, ha="right")
        axis.axvline(2.65, color="0.6", lw=0.8)  # the paper's, this project's
        axis.set(title={"err_k": "error of the faults, err_k (dotted: k̂ = 0)",
                        "err_i": "error of the signal rebuilt, err_i"}[quantity])  # fmt: skip
        axis.yaxis.set_tick_params(labelleft=True)
        axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
        axis.yaxis.set_major_formatter("{x:g}")
        axis.grid(axis="y", alpha=0.3)
    axes[0].legend(frameon=False)
    figure.savefig(out / "figure2.png")

    found = results["schedules"]
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.3), layout="constrained")
    for axis, test in zip(axes, SETS, strict=True):
        for name, medians in found[test].items():
            axis.plot(found["n"], medians, "o-", ms=4, label=name)
        axis.set(xscale="log", yscale="log", xlabel="number of points n_ω", ylabel="median err_k", title=f"{test} set")
        axis.set_xticks(found["n"], [str(n) for n in found["n"]])
        axis.minorticks_off()
        axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.yaxis.set_major_formatter("{x:g}")
        axis.grid(alpha=0.3)
    axes[0].legend(frameon=False)
    figure.savefig(out / "schedules.png")
    plt.close("all")
