"""What the report shows of sets, of what would tell them apart, of the gain over folds, and of an unfinished search."""

from __future__ import annotations

import pytest
from axe_look import BROWSER, look
from ema_postflight.discrepancy import list_leading

from ema.discrepancy.findings import Findings, FoundEffect, Gain, Quantity
from ema.discrepancy.folds import Folds
from ema.discrepancy.progress import Progress
from ema.discrepancy.report import write_report

SCREENS = ((1280, 900, False), (1280, 900, True), (390, 844, True))


@pytest.fixture
def full():
    """An answer with everything that a report can show of it."""
    folds = Folds(("cycle 0", "cycle 1"), (2.2e-3, 1.8e-3), (1.1e-4, 0.9e-4), (1e-4, 1e-4), (1.0, 1.0))
    errors = 0.04, 0.01, folds.err_before, folds.err_after, folds.noise_floor
    intervals = ((0.008, 0.0123),) * 6
    gain = Gain(*errors, (0.0,) * 6, (0.01,) * 6, k_interval=intervals, folds=folds, residual=folds)
    stiffness = Quantity(100.0, 95.0, 105.0, "N m/rad")
    spring = FoundEffect("spring_load", 0.49, ("constant_load",), {"stiffness": stiffness}, "a spring", "another place")
    sets = [(["spring_load"], 0.72, 0.0), (["constant_load"], 0.27, 1.0), ([], 0.0, 900.0)]
    posterior = [
        {"effects": e, "faults": ["k1"], "probability": p, "nats_behind": n, "nats_error": 0.4} for e, p, n in sets
    ]
    motion = {"motion": "a slow triangle", "deviations": 12.3, "deviations_by_chance": 3.6, "shows_in": "torque"}
    nxt = {"between": [["spring_load"], ["constant_load"]], "cycles": 4, "motions": [motion],
           "sentence": "To tell spring_load from constant_load, record 4 cycles of a slow triangle"}  # fmt: skip
    lost = [{"name": "inertia", "before": 9.0, "after": 5.0, "nats": 41.2, "nats_error": 0.5, "nats_of": "evidence",
             "why": "41.2 ± 0.5 nats behind spring_load by the evidence of the record; leaves 5"},
            {"name": "cogging", "before": 9.0, "after": 6.0, "nats": None, "nats_error": None, "nats_of": None,
             "why": "leaves 6"}]  # fmt: skip
    return Findings("explained", [spring], gain, posterior=posterior, next_recording=nxt, rejected=lost)


@pytest.mark.slow
def test_sets_and_what_would_tell_them_apart_are_shown(full, tmp_path):
    page = tmp_path / "report.html"
    write_report(page, "bench", ["flight.csv"], full, [])
    text = page.read_text()
    for words in (
        "Leading sets",
        "faults alone",
        "0.720",
        "1.0 ± 0.4",
        "What to record next",
        "a slow triangle",
        "12.3",
        "0.008 … 0.0123",
        "weighed by its noise, which sees more, 1 ±",
        "39.2",  # deviations of the spring from none
        "behind the answer [nats]",
        "41.2 ± 0.5 nats behind spring_load",
        "not known",
    ):
        assert words in text
    assert "Held out one by one, the error of 2 parts falls from" in text
    for screen in SCREENS if BROWSER is not None else ():
        seen = look(page, *screen)
        assert seen["found"] == []
        assert not seen["wide"]


def test_an_unfinished_report_claims_nothing(tmp_path):
    progress = Progress()
    progress.fitted((), 5.0, {"k1": 0.02})
    progress.fitted(("cogging",), 1.2, {"k1": 0.0, "cogging.amplitude": 0.009})
    page = tmp_path / "report.html"
    write_report(page, "bench", ["flight.csv"], progress.unfinished(), [])
    text = page.read_text()
    assert "Unfinished" in text
    assert "What led when it was interrupted" in text
    assert "cogging.amplitude 0.009" in text
    for claim in ("<h2>Causes", "<h2>Gain", "Leading sets", "nan"):
        assert claim not in text
    if BROWSER is not None:
        assert look(page, 390, 844, dark=True)["found"] == []


def test_what_was_weighed_by_another_noise_does_not_lead():
    told = []
    progress = Progress(told.append)
    progress.fitted(("cogging",), 0.5, {}, by="an earlier noise")
    progress.fitted((), 3.0, {}, by="this noise")
    progress.fitted(("spring_load",), 4.0, {}, by="this noise")
    assert [t.said for t in progress.leading()] == ["no effect", "spring_load"]
    assert told[-1] == "spring_load: leaves 4 of held-out parts; leading: no effect, 3"


def test_only_what_leads_gets_a_line_where_the_rest_may_pass_by():
    told, passed = [], []
    progress = Progress(told.append, passed.append)
    progress.fitted((), 3.0, {})
    progress.fitted(("spring_load",), 4.0, {})
    progress.fitted(("cogging",), 2.0, {})
    assert [text.split(":")[0] for text in told] == ["no effect", "cogging"]
    assert [text.split(":")[0] for text in passed] == ["spring_load"]


def test_sets_of_the_same_names_are_one_line_of_probability():
    """Two lines of other orders are two sets, and were told as "cogging 0.60, cogging 0.30"."""
    sets = [{"effects": names, "probability": p} for names, p in ((["cogging"], 0.6), (["cogging"], 0.3), ([], 0.1))]
    findings = Findings("explained", [], Gain(1.0, 0.1, 1.0, 0.1, 0.1), posterior=sets)
    assert list_leading(findings) == ["Probabilities of the sets fitted: cogging 0.90, faults alone 0.10."]
