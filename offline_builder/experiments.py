"""The paper's experiments and this project's beside them. Each is a function of the bench, and answers with numbers."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from scipy.stats import qmc

from ema.bundle import Bundle
from ema.core.status import Reason, Status
from ema.identification import Estimate, Identifier, Measurement, identifier
from ema.identification import lf1 as lf1_identifier
from ema.identification.gauss_newton import GaussNewton
from ema.identification.weighted import Whitener, bounded_least_squares
from ema.models import hf, lf1
from ema.reduction.schedules import SCHEDULES, Knowledge, schedule

from .noise import shrunk, unbiased
from .runs import random_starts

SEED = 20260301
SETS = {"small": 0.05, "large": 0.3}
N_TEST = 100
N_HF = 60  # of these for the HF model in the loop
N_OTHER = 36  # fault vectors of each case of `elsewhere`
N_COMBINED = 24
LEVELS = (0.5, 0.9, 0.95)
N_TRAIN = 400
N_POINTS = (6, 12, 20, 30, 50, 100, 200)
COMBINED = ("linear", "lf2")
OTHERS = ("linear", "lf2", "hf")
METHODS = ("textbook linear", "textbook lf1", "textbook lf2", "linear", "lf1", "lf2", "hf")


class TextbookLinear:
    """Eq. (3) and nothing else: QR of A, no weights, no bounds."""

    def __init__(self, bundle: Bundle):
        self.bundle = bundle

    def estimate(self, measurement: Measurement) -> Estimate:
        """Solve R k = Qᵀ Δi; no uncertainty is known."""
        b, nan = self.bundle, np.full(6, np.nan)
        k = np.linalg.solve(b.arrays["R"], b.arrays["Q"].T @ (measurement.i_hat - b.i0[b.schedule]))
        return Estimate(
            *("textbook linear", k, nan, np.full((6, 6), np.nan), np.nan, 0, np.nan, nan, Status.VALID, Reason(0))
        )


@dataclass(frozen=True)
class Bench:
    """A bundle, and HF runs made for the comparison: none of them went into the bundle."""

    bundle: Bundle
    n_threads: int = 2

    def runs(self, k: np.ndarray, stream: int) -> np.ndarray:
        """Envelopes of fault vectors `k` (n, 6), shape (n, n_t). [A]"""
        seeds = SEED + stream * 10**6 + np.arange(len(k))
        return hf.simulate(self.bundle.plant, k, seeds=seeds, n_threads=self.n_threads).envelope

    @cached_property
    def tests(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """The two test sets: fault vectors (100, 6) and envelopes (100, n_t)."""
        rng = np.random.default_rng(SEED)
        faults = {name: rng.uniform(0.0, k_max, (N_TEST, 6)) for name, k_max in SETS.items()}
        return {name: (k, self.runs(k, j)) for j, (name, k) in enumerate(faults.items())}

    @cached_property
    def training(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Campaigns over the ranges of the test sets, for regressions."""
        unit = qmc.LatinHypercube(6, rng=np.random.default_rng(SEED + 1)).random(N_TRAIN)
        return {name: (unit * k_max, self.runs(unit * k_max, 10 + j)) for j, (name, k_max) in enumerate(SETS.items())}

    @cached_property
    def nominal(self) -> np.ndarray:
        """Runs without fault (N_TRAIN, n_t). [A]"""
        return self.runs(np.zeros((N_TRAIN, 6)), 20)

    def identifier(self, method: str) -> Identifier:
        """By name; "textbook …" are the paper's."""
        if not method.startswith("textbook"):
            return identifier(method, self.bundle)
        name = method.split()[1]
        return TextbookLinear(self.bundle) if name == "linear" else self._textbook(name)

    def _textbook(self, name: str) -> GaussNewton:
        """The paper's iteration: no weights, nothing known of the model's error, started at k = 0."""
        b, n = self.bundle, len(self.bundle.schedule)
        zeros = np.zeros((2, len(b.arrays["noise_sizes"]), 1, 1))
        noise = b.noise("linear")
        plain = replace(noise, switching=1e-4 * np.eye(n), model_error=zeros, start=np.zeros((n, n)))
        library, tuning = b.lf2().at(b.schedule), lf1.Tuning(*b.arrays["lf1_tuning"])
        if name == "lf2":
            return GaussNewton(name, lambda k, start: library(k), plain, lambda m: np.zeros(6))
        return GaussNewton(
            *(name, lambda k, start: lf1.simulate(b.plant, k, tuning)[:, b.schedule], plain, lambda m: np.zeros(6)),
            lf1_identifier.OPTIONS,
        )


def err_k(k_hat: np.ndarray, k: np.ndarray) -> np.ndarray:
    """Eq. (5) as it must be read.   ‖k̂ - k‖ / √6"""
    return np.asarray(np.linalg.norm(k_hat - k, axis=-1) / np.sqrt(6.0))


def err_i(i: np.ndarray, i_ref: np.ndarray) -> np.ndarray:
    """Eq. (6).   ‖i - i_ref‖ / ‖i_ref‖"""
    return np.asarray(np.linalg.norm(i - i_ref, axis=-1) / np.linalg.norm(i_ref, axis=-1))


def timed(f: Callable[[], Any], n: int = 3) -> float:
    """Best of `n` times of the processor. [s]"""
    best = np.inf
    for _ in range(n):
        begin = time.process_time()
        f()
        best = min(best, time.process_time() - begin)
    return float(best)


def models(bench: Bench) -> dict[str, Any]:
    """HF, LF1 and LF2 on the same fault vectors: err_i against a run of HF, and time per evaluation."""
    b = bench.bundle
    tuning, library = lf1.Tuning(*b.arrays["lf1_tuning"]), b.lf2()
    evaluate: dict[str, Callable[[np.ndarray], np.ndarray]] = {
        "hf": lambda k: hf.simulate(b.plant, k, seeds=SEED + 7 * 10**6 + np.arange(len(k))).envelope,
        "lf1": lambda k: lf1.simulate(b.plant, k, tuning),
        "lf2": library,
    }
    answer: dict[str, Any] = {}
    for name, model in evaluate.items():
        errors = {s: float(np.median(err_i(model(k), x))) for s, (k, x) in bench.tests.items()}
        k = bench.tests["small"][0][:16]
        model(k)
        answer[name] = {"err_i": errors, "time": timed(partial(model, k)) / 16}
    return answer


def identifiers(bench: Bench, method: str) -> dict[str, Any]:
    """One identifier on both test sets: err_k, err_i, online time, coverage of its intervals, its test of fit."""
    b, made = bench.bundle, bench.identifier(method)
    answer: dict[str, Any] = {}
    for name, (k, x) in bench.tests.items():
        if method == "hf":
            k, x = k[:N_HF], x[:N_HF]
        measured = [Measurement.complete(row[b.schedule], np.zeros(2)) for row in x]
        made.estimate(measured[0])
        begin = time.process_time()
        estimates = [made.estimate(m) for m in measured]
        seconds = (time.process_time() - begin) / len(k)
        k_hat = np.array([e.k for e in estimates])
        answer[name] = {
            "err_k": err_k(k_hat, k).tolist(),
            "err_i": err_i(_rebuilt(bench, method, k_hat), x).tolist(),
            "rms": np.sqrt(np.mean((k_hat - k) ** 2, axis=0)).tolist(),
            "null": float(np.median(err_k(np.zeros(6), k))),
            "time": seconds,
            **_claims(estimates, k),
        }
    return answer


def _rebuilt(bench: Bench, method: str, k_hat: np.ndarray) -> np.ndarray:
    """The signal that the identifier's own model gives for its answer, shape (n, n_t). [A]"""
    b, inside = bench.bundle, np.clip(k_hat, 0.0, 1.0)
    if method == "hf":
        return bench.runs(inside, 30)
    if "lf1" in method:
        return lf1.simulate(b.plant, inside, lf1.Tuning(*b.arrays["lf1_tuning"]))
    if "lf2" in method:
        return b.lf2()(inside)
    return np.asarray(b.i0 + k_hat @ b.arrays["A_full"].T)


def _claims(estimates: list[Estimate], k: np.ndarray) -> dict[str, Any]:
    """What came of the intervals' and of the test of fit's claims.

    Standard errors are those of means over cycles: faults of one cycle err together.
    """
    answer: dict[str, Any] = {"coverage": {}, "coverage_se": {}}
    for level in LEVELS:
        low, high = np.moveaxis(np.array([e.interval(level) for e in estimates]), -1, 0)
        within = ((k >= low) & (k <= high)).mean(axis=1)
        answer["coverage"][f"{level:g}"] = float(within.mean())
        answer["coverage_se"][f"{level:g}"] = float(within.std(ddof=1) / np.sqrt(len(k)))
    p = np.array([e.p_value for e in estimates])
    return {**answer, "rejected": {f"{a:g}": float(np.mean(p < a)) for a in (0.001, 0.01, 0.05)}}


def elsewhere(bench: Bench, method: str) -> dict[str, Any]:
    """The same on what use brings: one fault growing alone, and cycles that start inside backlash and stiction."""
    b, made, plant = bench.bundle, bench.identifier(method), bench.bundle.plant
    rng = np.random.default_rng(SEED + 2)
    alone = np.zeros((N_OTHER, 6))
    alone[np.arange(N_OTHER), np.arange(N_OTHER) % 6] = rng.uniform(0.0, 0.4, N_OTHER)
    cases = {"one fault alone": (alone, False), "one fault alone, any start": (alone, True)}
    for name, k_max in SETS.items():
        cases[f"{name}, any start"] = rng.uniform(0.0, k_max, (N_OTHER, 6)), True
    answer: dict[str, Any] = {}
    for j, (name, (k, moved)) in enumerate(cases.items()):
        start = random_starts(plant, k, SEED + 3 + j) if moved else None
        seeds = SEED + (100 + j) * 10**6 + np.arange(len(k))
        r = hf.simulate(plant, k, seeds=seeds, start=start, n_threads=bench.n_threads)
        seen = np.column_stack([r.theta_u[:, 0], r.theta_m[:, 0] / plant.transmission.GR])
        estimates = [made.estimate(Measurement.complete(*m)) for m in zip(r.envelope[:, b.schedule], seen, strict=True)]
        error = err_k(np.array([e.k for e in estimates]), k)
        answer[name] = {"err_k": float(np.median(error)), "null": float(np.median(err_k(np.zeros(6), k))),
                        **_claims(estimates, k)}  # fmt: skip
    return answer


def schedules(bench: Bench) -> dict[str, Any]:
    """Weighted linear identifier on both test sets, every schedule at several numbers of points."""
    b = bench.bundle
    know = Knowledge(b.t, b.arrays["v1"], b.arrays["A_full"], bench.nominal)
    answer: dict[str, Any] = {"n": list(N_POINTS), **{test: {} for test in SETS}}
    for name in SCHEDULES:
        points = [schedule(name, know, n, SEED) for n in N_POINTS]
        for test in SETS:
            answer[test][name] = [_weighted_linear(bench, test, at) for at in points]
    return answer


def _weighted_linear(bench: Bench, test: str, at: np.ndarray) -> float:
    """Median err_k with the points `at`; weights from a campaign: switching and what is not linear."""
    b = bench.bundle
    k, x = bench.tests[test]
    k_train, x_train = bench.training[test]
    A_full = b.arrays["A_full"]
    rest = (x_train - b.i0 - k_train @ A_full.T)[:, at]
    white = Whitener(unbiased(shrunk(rest.T @ rest / len(rest), len(rest)), len(rest)))
    A = white(A_full[at])
    k_hat = [bounded_least_squares(A, white(r), np.zeros(6), np.ones(6)).x for r in (x - b.i0)[:, at]]
    return float(np.median(err_k(np.array(k_hat), k)))


def maps(bench: Bench) -> dict[str, Any]:
    """Linear answers: Jacobian by differences, Jacobian regressed over a campaign, and the inverse map (ridge)."""
    b = bench.bundle
    at, i0 = b.schedule, b.i0[b.schedule]
    answer: dict[str, Any] = {}
    for name, (k, x) in bench.tests.items():
        k_train, x_train = bench.training[name]
        d, d_train = x[:, at] - i0, x_train[:, at] - i0
        regressed = np.linalg.lstsq(k_train, d_train, rcond=None)[0].T
        X, X_train = (np.column_stack([np.ones(len(m)), m]) for m in (d, d_train))
        G = X_train.T @ X_train
        inverse = np.linalg.solve(G + 1e-4 * np.trace(G) / len(G) * np.eye(len(G)), X_train.T @ k_train)
        found = {
            "differences": np.linalg.lstsq(b.A, d.T, rcond=None)[0].T,
            "regressed": np.linalg.lstsq(regressed, d.T, rcond=None)[0].T,
            "inverse map": X @ inverse,
        }
        answer[name] = {map_name: float(np.median(err_k(k_hat, k))) for map_name, k_hat in found.items()}
    return answer


def bound(bench: Bench) -> dict[str, Any]:
    """Cramér–Rao bound of each fault at k = 0 from the schedule's points and one cycle."""
    A, S = bench.bundle.A, bench.bundle.arrays["noise_switching"]
    return {"sd": np.sqrt(np.diag(np.linalg.inv(A.T @ np.linalg.solve(S, A)))).tolist()}


def combined(bench: Bench) -> dict[str, Any]:
    """Several cycles of the same actuator, their envelopes averaged: median err_k on both test sets."""
    b = bench.bundle
    answer: dict[str, Any] = {"n": [1, 2, 4, 8], **{test: {} for test in SETS}}
    for j, test in enumerate(SETS):
        k = bench.tests[test][0][:N_COMBINED]
        x = np.array([bench.runs(k, 40 + 10 * j + cycle)[:, b.schedule] for cycle in range(8)])
        for method in COMBINED:
            answer[test][method] = [_of_mean(b, method, k, x[:n]) for n in answer["n"]]
    return answer


def _of_mean(b: Bundle, method: str, k: np.ndarray, x: np.ndarray) -> float:
    """Median err_k from the mean of cycles `x` (n_cycles, n, n_omega): less switching, the same model's error."""
    made: Any = identifier(method, b)
    made.noise = replace(made.noise, switching=made.noise.switching / len(x))
    k_hat = [made.estimate(Measurement.complete(i, np.zeros(2))).k for i in x.mean(axis=0)]
    return float(np.median(err_k(np.array(k_hat), k)))


def qr_cost(bench: Bench) -> dict[str, Any]:
    """QR of A at the schedule and over the whole cycle: the paper's six orders of magnitude."""
    a, full = bench.bundle.A, bench.bundle.arrays["A_full"]
    return {"schedule": timed(lambda: np.linalg.qr(a), 200), "full": timed(lambda: np.linalg.qr(full), 50)}
