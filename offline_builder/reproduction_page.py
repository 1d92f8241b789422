"""The page of `ema reproduce`: every number on it is measured by the run that wrote it."""

from __future__ import annotations

from typing import Any

import numpy as np

from ema.bundle import Bundle
from ema.core.names import FAULT_MEANING, FAULTS

from . import experiments as e

PAPER_TIME = {"textbook linear": (2.4e-4, 1.9e-4), "textbook lf1": (18.0, 31.0), "textbook lf2": (1.6, 2.9)}


def page(bundle: Bundle, results: dict[str, Any]) -> str:
    """The page in Markdown."""
    m, r = bundle.manifest, results
    found = {name: r[f"identifier {name}"] for name in e.METHODS}
    err = {name: {s: float(np.median(found[name][s]["err_k"])) for s in e.SETS} for name in e.METHODS}
    parts = [
        "# The paper reproduced",
        f"Written by `ema reproduce`. Bundle: {m['figures']['n_runs']:.0f} HF runs, of these "
        f"{m['builder']['campaign']['n_snapshots']} snapshots for the POD; builder seed {m['builder']['seed']}, "
        f"seed of the experiments {e.SEED}. Times are the processor's, of this machine; everything else "
        "repeats with the seeds. *textbook*: as in the paper, no weights, nothing known of the model's error. Without "
        "that word: weighted by the measured noise, the model's known error taken off (not for `linear`), 0 ≤ k ≤ 1. "
        "`hf`: Gauss–Newton on the HF model, begun at LF2's answer; all its runs of a cycle together correct LF2 near "
        "the answer.",
        _models(r["models"]),
        "## POD and sampling points\n\n![Figure 1](figure1.png)\n\n"
        f"λ₁ share {bundle.arrays['eigenvalue_share'][0]:.4f} (paper: 0.7575, with other parameters and another range "
        "of faults).",
        "## Identifiers on two test sets\n\n![Figure 2](figure2.png)\n\n" + _identifiers(found, err),
        _coverage(r),
        _bound(r),
        "## Sampling schedules\n\n![Schedules](schedules.png)\n\n" + _schedules(r["schedules"]),
        _maps(r["maps"]),
        _combined(r["combined"]),
        _elsewhere(r),
        _conclusions(r, err, found),
    ]
    return "\n\n".join(parts) + "\n"


def _models(models: dict[str, Any]) -> str:
    rows = [
        [
            name,
            *_f(models[name]["err_i"].values()),
            f"{1e3 * models[name]['time']:.3f}",
            f"{models['hf']['time'] / models[name]['time']:.1f}",
        ]
        for name in models
    ]
    return (
        "## Models\n\nMedian err_i (6) against a run of HF; HF's own is its switching noise. Time per evaluation in a "
        "batch of 16 on one core.\n\n" + _table(["model", "small", "large", "time [ms]", "× faster than HF"], rows)
    )


def _identifiers(found: dict[str, Any], err: dict[str, Any]) -> str:
    rows = [
        ["(null: k̂ = 0)", *_f(found["linear"][s]["null"] for s in e.SETS), "", "", "", "", ""],
        *(
            [
                name,
                *_f(err[name].values()),
                *_f(np.median(found[name][s]["err_i"]) for s in e.SETS),
                *(f"{found[name][s]['time']:.1e}" for s in e.SETS),
                " / ".join(f"{t:.1e}" for t in PAPER_TIME.get(name, ())),
            ]
            for name in e.METHODS
        ),
    ]
    head = ["method", "err_k small", "err_k large", "err_i small", "err_i large", "time small [s]", "time large [s]",
            "paper's time [s]"]  # fmt: skip
    return (
        f"Medians over {e.N_TEST} fault vectors each (hf: {e.N_HF}), one cycle each; table 1. err_i is that of the "
        "signal over the whole cycle, rebuilt by the model alone: what is known of a model's error is known at the "
        "scheduled instants only.\n\n" + _table(head, rows)
    )


CLAIMS = ["50 %", "90 %", "95 %", "p < 0.001", "p < 0.01", "p < 0.05"]


def _claims(c: dict[str, Any]) -> list[str]:
    shares = [f"{c['coverage'][level]:.3f} ± {c['coverage_se'][level]:.3f}" for level in c["coverage"]]
    return [*shares, *_f(c["rejected"].values(), 3)]


def _coverage(r: dict[str, Any]) -> str:
    found = {(m, s): r[f"identifier {m}"][s] for m in ("linear", "lf2", "lf1", "hf") for s in e.SETS}
    outside = [
        f"{method} on the {s} set, {100 * float(level):.0f} % ({share:.3f})"
        for (method, s), c in found.items()
        for level, share in c["coverage"].items()
        if abs(share - float(level)) > 0.03
    ]
    return (
        "## Uncertainty\n\nShare of true faults within the 50, 90 and 95 % intervals "
        f"({6 * e.N_TEST} each, hf {6 * e.N_HF}, with the standard error of so many cycles), "
        "and share of cycles whose chi-square test of fit fails at the level said "
        "(the models are right there, so it should be the level).\n\n"
        + _table(["method", "set", *CLAIMS], [[*key, *_claims(c)] for key, c in found.items()])
        + "\n\nFarther from their level than the 3 points aimed at: " + ("; ".join(outside) or "none") + "."
    )  # fmt: skip


def _elsewhere(r: dict[str, Any]) -> str:
    rows = [
        [method, case, f"{c['null']:.4f}", f"{c['err_k']:.4f}", *_claims(c)]
        for method in e.OTHERS
        for case, c in r[f"elsewhere {method}"].items()
    ]
    return (
        f"## One fault alone, any start\n\n{e.N_OTHER} cycles each. *Alone*: one of the six, U(0, 0.4), the others "
        "exactly zero; an interval that reaches down to zero holds those, so that shares may exceed the level. *Any "
        "start*: at rest anywhere within ±0.2 mrad and the gap, as measured.\n\n"
        + _table(["method", "case", "null", "median err_k", *CLAIMS], rows)
    )


def _combined(found: dict[str, Any]) -> str:
    rows = [[method, test, *_f(found[test][method])] for test in e.SETS for method in found[test]]
    return (
        f"## Several cycles combined\n\nEnvelopes of so many cycles averaged, median err_k over {e.N_COMBINED} fault "
        "vectors. Switching averages out, a model's own error does not.\n\n"
        + _table(["method", "set", *map(str, found["n"])], rows)
    )


def _bound(r: dict[str, Any]) -> str:
    sd = r["bound"]["sd"]
    rows = [["Cramér–Rao bound, one cycle", *_f(sd)]]
    for method in ("linear", "lf2", "lf1", "hf"):
        rms = r[f"identifier {method}"]["small"]["rms"]
        rows.append([f"{method}: rms error (over bound)",
                     *(f"{x:.4f} ({x / b:.2f})" for x, b in zip(rms, sd, strict=True))])  # fmt: skip
    names = [f"{f} {FAULT_MEANING[f]}" for f in FAULTS]
    return (
        "## Bound and error, small set\n\nThe bound is that of unbiased estimates; knowing 0 ≤ k lets an error be a "
        "little below it.\n\n" + _table(["", *names], rows)
    )


def _schedules(found: dict[str, Any]) -> str:
    rows = [[name, test, *_f(found[test][name])] for test in e.SETS for name in found[test]]
    at30 = {test: {name: m[found["n"].index(30)] for name, m in found[test].items()} for test in e.SETS}
    said = [
        f"On the {test} set the best at 30 points is `{min(m, key=m.__getitem__)}` ({min(m.values()):.4f}); SOM has "
        f"{m['som']:.4f}, uniform {m['uniform']:.4f}."
        for test, m in at30.items()
    ]
    return (
        "Median err_k, weighted linear identifier, weights for the range of the set:\n\n"
        + _table(["schedule", "set", *map(str, found["n"])], rows)
        + "\n\n" + " ".join(said) + " `greedy` knows the Jacobian and the noise at k = 0 and is made for early signs: "
        "it is recommended where those matter most (`schedule.method` in the builder's configuration). SOM stays the "
        "default: the paper's, and as good as any on the large set."
    )  # fmt: skip


def _maps(maps: dict[str, Any]) -> str:
    rows = [[name, *_f(maps[s][name] for s in e.SETS)] for name in maps["small"]]
    return (
        "## Regressed maps\n\nUnweighted linear answers, median err_k; each regression over a campaign of the test "
        f"set's own range ({e.N_TRAIN} runs).\n\n" + _table(["map", "small", "large"], rows)
    )


def _conclusions(r: dict[str, Any], err: dict[str, Any], found: dict[str, Any]) -> str:
    null = {s: found["linear"][s]["null"] for s in e.SETS}
    ratio = r["qr"]["full"] / r["qr"]["schedule"]
    speed = {name: r["models"]["hf"]["time"] / r["models"][name]["time"] for name in ("lf1", "lf2")}
    t = "textbook "
    claims = [
        (f"Linear works for small faults: err_k {err[t + 'linear']['small']:.4f} against null {null['small']:.4f}.",
         err[t + "linear"]["small"] < null["small"]),
        (f"Linear fails far from nominal: {err[t + 'linear']['large']:.4f} against null {null['large']:.4f}.",
         err[t + "linear"]["large"] > 0.5 * null["large"]),
        (f"LF1 is the most consistent of the paper's three: {err[t + 'lf1']['small']:.4f} small, "
         f"{err[t + 'lf1']['large']:.4f} large.",
         err[t + "lf1"]["large"] < min(err[t + "linear"]["large"], err[t + "lf2"]["large"])),
        (f"LF2 lies between linear and LF1 on large faults: {err[t + 'lf2']['large']:.4f}.",
         err[t + "lf1"]["large"] < err[t + "lf2"]["large"] < err[t + "linear"]["large"]),
        (f"LF2 is slightly better than LF1 on small faults: {err[t + 'lf2']['small']:.4f} against "
         f"{err[t + 'lf1']['small']:.4f}.", err[t + "lf2"]["small"] < err[t + "lf1"]["small"]),
        (f"LF1 is more than ten times faster than HF: {speed['lf1']:.0f} times.", speed["lf1"] > 10),
        (f"LF2 is three orders of magnitude faster than HF: {speed['lf2']:.0f} times.", speed["lf2"] > 300),
        (f"Compression makes the QR six orders cheaper: {ratio:.0f} times (cost is linear in rows, of which there are "
         f"{5001 / 30:.0f} times fewer).", ratio > 1e5),
        (f"HF in the loop is not viable online: {found['hf']['large']['time']:.1f} s per cycle on one core, err_k "
         f"{err['hf']['small']:.4f} small, {err['hf']['large']:.4f} large.", found["hf"]["large"]["time"] > 30),
    ]  # fmt: skip
    return "## The paper's conclusions\n\n" + "\n".join(
        f"- {'Holds' if holds else 'Does not hold'} here. {text}" for text, holds in claims
    )


def _f(values: Any, digits: int = 4) -> list[str]:
    return [f"{float(v):.{digits}f}" for v in values]


def _table(head: list[str], rows: list[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
