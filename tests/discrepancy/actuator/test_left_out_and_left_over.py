"""Every cycle foretold by the others, on a toy whose refits are exact; and the verdict on what causes leave."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ema.discrepancy.actuator.fitting.free import Free
from ema.discrepancy.actuator.fitting.leave_out import over_folds, settled, square
from ema.discrepancy.actuator.fitting.model import N_FINAL, Model
from ema.discrepancy.actuator.simulating.plant import ENVELOPE_STEP
from ema.discrepancy.actuator.simulating.runs import Runs
from ema.discrepancy.actuator.telling import remains as module
from ema.discrepancy.actuator.telling.remains import remains
from ema.discrepancy.folds import Folds

N, N_CYCLES, N_ENVELOPE = 60, 5, 400
FREES = tuple(Free(name, -9.0, 9.0, 0.05) for name in ("k1", "toy.x"))
SD = 0.3  # of the envelope [A]


class Toy:
    """Cycles of one motion whose features and envelope are linear in two parameters; whitened already."""

    def __init__(self):
        rng = np.random.default_rng(4)
        self.A, self.B = 3.0 * rng.standard_normal((2, N)), rng.standard_normal((2, N_ENVELOPE))
        truth = np.array([0.4, 0.5])
        y = [truth @ self.A + rng.standard_normal(N) for _ in range(N_CYCLES)]
        envelopes = [truth @ self.B + SD * rng.standard_normal(N_ENVELOPE) for _ in range(N_CYCLES)]
        self.data = SimpleNamespace(
            motion=np.zeros(N_CYCLES, int), dT=np.zeros(N_CYCLES), n_cycles=N_CYCLES, y=y, envelopes=envelopes,
            labels=tuple(f"cycle {c}" for c in range(N_CYCLES)),
        )  # fmt: skip
        self.first, self.n_motions = [0], 1
        self.plant = SimpleNamespace(control=SimpleNamespace(rate=1e4))

    def at(self, point):
        return np.array([point.get(f.name, 0.0) for f in FREES])

    def means(self, points, cycles, n_seeds, seed, steps=None):
        return [{c: self.at(point) @ self.A for c in cycles} for point in points]

    def each(self, wanted, n_seeds, seed, steps=None):
        envelope = self.B[:, ::ENVELOPE_STEP]
        return [
            {c: Runs((self.at(point) @ self.A)[None], (self.at(point) @ envelope)[None]) for c in cycles}
            for point, cycles in wanted
        ]


@pytest.fixture
def search():
    plant = Toy()
    fresh = np.random.default_rng(9).standard_normal((400, N))
    own = SimpleNamespace(white=lambda x: x, fresh=fresh, envelope_sd=np.full(N_ENVELOPE // ENVELOPE_STEP, SD))
    noise = SimpleNamespace(plant=plant, motions=[own], of=lambda c: own)
    return SimpleNamespace(plant=plant, noise=noise)


def solved(toy, cycles, free):
    A = np.tile(toy.A[: len(free)], len(cycles)).T
    return np.linalg.lstsq(A, np.concatenate([toy.data.y[c] for c in cycles]), rcond=None)[0]


def model(toy, n_free, wrong=1.0):
    """Fitted to all cycles; its Jacobian may be a `wrong` multiple of what it is."""
    free = FREES[:n_free]
    point = dict(zip((f.name for f in free), solved(toy, range(N_CYCLES), free).tolist(), strict=True))
    columns = {(0, f.name): wrong * a for f, a in zip(free, toy.A, strict=False)}
    return Model((), SimpleNamespace(point=point, free=free, columns=columns), 1.0)


def test_each_cycle_is_foretold_as_by_a_whole_fit_to_the_others(search):
    toy = search.plant
    before, after = model(toy, 1), model(toy, 2)
    error, residual = over_folds(search, before, after)
    assert residual.names == error.names == toy.data.labels
    for c in range(N_CYCLES):
        others = [j for j in range(N_CYCLES) if j != c]
        for n_free, told in ((1, residual.before), (2, residual.after)):
            x = solved(toy, others, FREES[:n_free])
            assert told[c] == pytest.approx(np.mean((toy.data.y[c] - x @ toy.A[:n_free]) ** 2), rel=1e-4)
        x = solved(toy, others, FREES)
        skip = settled(toy)
        left = (toy.data.envelopes[c] - x @ toy.B)[::ENVELOPE_STEP][skip:]
        assert error.after[c] == pytest.approx(np.mean(left**2), rel=1e-4)
        assert error.after[c] == pytest.approx(square(toy, c, (x @ toy.B)[::ENVELOPE_STEP]), rel=1e-4)


def test_floors_are_what_noise_makes_of_a_cycle_and_of_the_mean_it_is_compared_with(search):
    error, residual = over_folds(search, model(search.plant, 1), model(search.plant, 2))
    assert error.floor == pytest.approx([SD**2 * (1.0 + 1.0 / N_FINAL)] * N_CYCLES)
    assert residual.floor == pytest.approx([1.0 + 1.0 / N_FINAL] * N_CYCLES, rel=0.05)
    assert residual.rest == pytest.approx(1.0, abs=0.15)
    assert residual.err_before > 1.5 * residual.err_after
    assert settled(search.plant) == 15  # of 15 ms at 10 kHz, every tenth sample


def test_a_step_that_leads_away_is_not_taken(search):
    """Where the Jacobian is wrong, simulation says so, and the parameters of all cycles stay."""
    toy = search.plant
    wrong = model(toy, 2, wrong=-0.05)
    _, residual = over_folds(search, wrong, wrong)
    x = toy.at(wrong.fit.point)
    assert residual.after == pytest.approx([float(np.mean((y - x @ toy.A) ** 2)) for y in toy.data.y])
    assert residual.before == residual.after


# ---- the verdict -------------------------------------------------------------------------------------------------


def folds(rest):
    return Folds(("a", "b"), (9.0, 9.0), (rest**2, rest**2), (1.0, 1.0), (1.0, 1.0))


NOISE, NO_NOISE = SimpleNamespace(is_noise=True), SimpleNamespace(is_noise=False)
CAUSE, LINE = SimpleNamespace(effect="viscous_drag"), SimpleNamespace(effect="torque_line")
FAULTS_ALONE = Model((), None, 9.0)


def judged(monkeypatch, after, rests, test=NOISE, nameless=(), named=True, alone_is=NOISE):
    """`rests`: what held-out parts leave over noise, by effects."""
    asked = []

    def over(search, before, told):
        asked.append(told.names)
        return folds(rests[told.names]), folds(rests[told.names])

    def without(m, effect):
        return Model(tuple(e for e in m.effects if e is not effect), None, m.heldout)

    monkeypatch.setattr(module, "over_folds", over)
    search = SimpleNamespace(say=lambda text: None, without=without, verdict=lambda m: alone_is)
    return remains(search, FAULTS_ALONE, after, test, nameless, named=named), asked


WITH_CAUSE = Model((CAUSE,), None, 1.0)
WITH_LINE = Model((CAUSE, LINE), None, 1.0)


@pytest.mark.parametrize(
    ("rest", "test", "verdict"),
    [
        (1.0, NOISE, "explained"),
        (1.5, NOISE, "partly explained"),
        (1.0, NO_NOISE, "explained"),
        (3.0, NO_NOISE, "partly explained"),
    ],
)
def test_what_named_causes_leave_decides(monkeypatch, rest, test, verdict):
    made, asked = judged(monkeypatch, WITH_CAUSE, {("viscous_drag",): rest}, test)
    assert made.verdict == verdict
    assert made.is_little == (verdict == "explained")
    assert made.model is WITH_CAUSE
    assert made.left.residual.rest == pytest.approx(rest)
    assert asked == [("viscous_drag",)]


@pytest.mark.parametrize(("rest", "verdict"), [(1.0, "adequate"), (4.0, "unexplained")])
def test_what_is_not_named_counts_as_left_and_is_not_told(monkeypatch, rest, verdict):
    rests = {(): rest, ("viscous_drag",): 1.0}
    made, _ = judged(monkeypatch, WITH_CAUSE, rests, NO_NOISE, named=False, alone_is=NO_NOISE)
    assert made.verdict == verdict
    assert made.model is FAULTS_ALONE


def test_a_line_without_a_name_is_left_out_where_nothing_is_missed_by_that(monkeypatch):
    rests = {("viscous_drag", "torque_line"): 1.0, ("viscous_drag",): 1.05}
    made, _ = judged(monkeypatch, WITH_LINE, rests, nameless=(LINE,))
    assert (made.verdict, made.model.names) == ("explained", ("viscous_drag",))
    assert made.error.rest == pytest.approx(1.05)


def test_a_line_without_a_name_that_is_missed_is_told_and_the_causes_explain_a_part(monkeypatch):
    rests = {("viscous_drag", "torque_line"): 1.0, ("viscous_drag",): 3.0}
    made, _ = judged(monkeypatch, WITH_LINE, rests, nameless=(LINE,), alone_is=NO_NOISE)
    assert (made.verdict, made.model.names) == ("partly explained", ("viscous_drag", "torque_line"))
    assert made.left.residual.rest == pytest.approx(3.0)
    assert made.error.rest == pytest.approx(1.0)
    assert not made.left.is_chance  # what the causes alone leave is asked, not what the line leaves
