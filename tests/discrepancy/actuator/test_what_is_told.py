"""What is told of an actuator's answer: intervals, probabilities, what lost and why, structure; and its pictures."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.examine import Examination
from ema.discrepancy.actuator.fitting.model import Model
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.reading.features import features, slices
from ema.discrepancy.actuator.scoring import entrants
from ema.discrepancy.actuator.simulating.noise import Verdict
from ema.discrepancy.actuator.simulating.plant import ENVELOPE_STEP
from ema.discrepancy.actuator.simulating.runs import Runs
from ema.discrepancy.actuator.telling import telling
from ema.discrepancy.actuator.telling.pictures import pictures
from ema.discrepancy.engine.contest import Outcome
from ema.discrepancy.engine.posterior import Entry


def named(*effects, heldout=1.0, by=None, misfit=1.0, point=None, sd=None, free=(), residuals=None):
    fit = SimpleNamespace(misfit=misfit, point=point or {}, sd=sd or {}, free=free, residuals=residuals or {})
    return Model(tuple(SimpleNamespace(effect=e) for e in effects), fit, heldout, by)


def weighed(names, log_evidence=0.0, error=0.3, point=None, sd=None):
    entrant = SimpleNamespace(names=names, causes=())
    return SimpleNamespace(
        entrant=entrant, log_evidence=log_evidence, error=error, point=point or {}, sd=sd or {},
    )  # fmt: skip


def posterior(**p):
    return Outcome([Entry(tuple(n for n in k.split("__") if n), x, 0.0, 0.0) for k, x in p.items()], [])


def test_a_rival_is_as_likely_as_the_set_with_it_in_the_effects_place():
    outcome = posterior(viscous_drag__inertia=0.6, cogging__inertia=0.3, inertia=0.1)
    answer = named("viscous_drag", "inertia")
    p = entrants.probabilities(outcome, answer, "viscous_drag", "cogging", "k1 and k2 alike")
    assert p == pytest.approx([0.6, 0.3, 0.1])  # faults in its place: the set without it
    assert entrants.probabilities(outcome, answer, "inertia") == pytest.approx([1.0])


@pytest.mark.parametrize(
    ("order", "sd", "is_whole"), [(12.02, 1e-3, True), (12.3, 1e-3, False), (12.3, 0.15, True), (35.99, 1e-3, True)]
)
def test_an_order_is_no_whole_number_only_where_that_is_sure(order, sd, is_whole):
    fit = SimpleNamespace(point={"cogging.order": order}, sd={"cogging.order": sd})
    assert telling._integer(fit, "cogging") == is_whole


def test_what_lost_is_told_by_evidence_where_it_was_weighed_and_else_by_held_out_cycles():
    noise = SimpleNamespace(expected=lambda cycles: 100.0)
    answer, before = named("viscous_drag", heldout=1.0, by=noise), named(heldout=9.0)
    tried = [
        named("inertia", heldout=1.4), named("inertia", heldout=1.2), named("cogging", heldout=1.5, by=noise),
        named("spring_load", heldout=2.0, by=object()), answer, before,
    ]  # fmt: skip
    outcome = Outcome([], [weighed(("viscous_drag",), 10.0, 0.3), weighed(("inertia",), -31.2, 0.4)])
    search = SimpleNamespace(tried=tried, heldout=[1])
    rows = {row["name"]: row for row in telling.describe_rejected(search, before, answer, outcome)}
    assert list(rows) == ["inertia", "cogging", "spring_load"]  # what leaves least first; not the answer, not faults
    assert (rows["inertia"]["nats"], rows["inertia"]["nats_of"]) == (pytest.approx(41.2), "evidence")
    assert rows["inertia"]["nats_error"] == pytest.approx(0.5)
    assert rows["inertia"]["after"] == 1.2
    assert "41.2 ± 0.5 nats behind viscous_drag" in rows["inertia"]["why"]
    assert (rows["cogging"]["nats"], rows["cogging"]["nats_of"]) == (pytest.approx(25.0), "held-out cycles")
    assert rows["spring_load"]["nats"] is None  # by another noise
    assert rows["spring_load"]["why"].startswith("leaves 2 of held-out cycles")


def test_of_a_set_that_was_likelier_it_is_said_that_it_is_before():
    answer = named("viscous_drag")
    outcome = Outcome([], [weighed(("viscous_drag",), 0.0), weighed(("inertia",), 3.0)])
    search = SimpleNamespace(tried=[named("inertia")], heldout=[1])
    (row,) = telling.describe_rejected(search, named(heldout=9.0), answer, outcome)
    assert row["nats"] == pytest.approx(-3.0)
    assert "3.0 ± 0.4 nats before viscous_drag" in row["why"]


def recorded(motion, train, heldout, loud, tried=()):
    data = SimpleNamespace(motion=np.array(motion), labels=tuple(f"cycle {c}" for c in range(len(motion))))
    noise = SimpleNamespace(misfit=lambda residuals, cycles: 2.0 if cycles[0] in loud else 1.0)
    plant = SimpleNamespace(data=data)
    search = SimpleNamespace(plant=plant, noise=noise, train=train, heldout=heldout, tried=list(tried))
    left = dict.fromkeys(train, None)
    return telling._recorded_once(search, named(heldout=1.0, misfit=2.0, residuals=left))


def test_a_rest_that_only_one_cycle_shows_asks_for_that_motion_again():
    (note,) = recorded([0, 0, 1], [0, 2], [1], loud=[2], tried=[named("cogging", misfit=1.1)])
    assert "cycle 2" in note
    assert "record it again" in note
    assert "cogging would take 90% of it" in note
    (note,) = recorded([0, 0, 1], [0, 2], [1], loud=[2], tried=[named("cogging", misfit=1.9)])
    assert "would take" not in note
    assert recorded([0, 0, 1], [0, 2], [1], loud=[]) == []
    assert recorded([0, 0, 1], [0, 2], [1], loud=[0, 2]) == []  # held-out cycles show it too


def found(sd_score, rest, least_sd=0.0, of=("viscous_drag",)):
    name = "viscous_drag.coefficient"
    free = (SimpleNamespace(name=name, low=0.0, high=1.0),)
    answer = named("viscous_drag", point={name: 6e-5}, free=free)
    own = weighed(of, point={name: 6e-5}, sd={name: sd_score})
    parameter = SimpleNamespace(name=name)
    own.entrant.causes = (SimpleNamespace(name="viscous_drag", parameters=(parameter,)),)
    outcome = Outcome([Entry(of, 1.0, 0.0, 0.0)], [own])
    return telling._describe_effect(answer, "viscous_drag", (), rest, outcome, {name: least_sd})


def test_an_interval_is_the_scores_and_as_wide_as_what_is_left_and_as_what_it_is_at_least():
    e = found(1e-6, rest=0.0)
    q = e.parameters["coefficient"]
    assert (e.name, q.value) == ("viscous_drag", 6e-5)
    assert q.high - q.low == pytest.approx(2 * 1.96e-6, rel=0.05)
    assert 0.98 < e.confidence < 1.0  # what does it may not be in the library at all
    wider = found(1e-6, rest=0.0, least_sd=5e-6).parameters["coefficient"]
    assert wider.high - wider.low == pytest.approx(2 * 1.96 * 5e-6, rel=0.05)
    larger = ("viscous_drag", "inertia")  # the answer itself was not weighed
    assert found(5e-6, 0.0, of=larger).parameters["coefficient"].high == pytest.approx(wider.high, rel=0.01)
    left = found(1e-6, rest=1.0).parameters["coefficient"]
    assert left.high - left.low == pytest.approx(2 * 1.96 * 0.5 * 6e-5, rel=0.05)
    assert left.low >= 0.0


# ---- pictures ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def examined(hidden, shipped_plant):
    """A search whose simulation gives the record itself, less a little: nothing is simulated."""
    cycles = hidden.cycles(hidden.Flaws(), 4, 1, motions=(hidden.chirp(), hidden.triangle(4e-3, 3.0, 0.5)))
    data = prepare(shipped_plant, [Record(tuple(Cycle(k, c) for k, c in enumerate(cycles)))])
    groups = [features(shipped_plant, data.signals[c]) for c in (0, 1)]

    class Echo:
        plant, n_motions = shipped_plant, 2

        def __init__(self):
            self.data, self.slices, self.asked = data, [slices(g) for g in groups], 0

        def repeated(self, points, cycles, n_seeds, seed, steps=None):
            self.asked += len(points)
            off = [1.0 - 0.2 * ("k1" not in point) for point in points]
            return [
                {c: Runs((x * data.y[c])[None], (x * data.envelopes[c][::ENVELOPE_STEP])[None]) for c in cycles}
                for x in off
            ]

        def means(self, points, cycles, n_seeds, seed, steps=None):
            return [{c: r.features[0] for c, r in at.items()} for at in self.repeated(points, cycles, n_seeds, seed)]

    own = [
        SimpleNamespace(
            sd=np.full(len(data.y[m]), 0.01), envelope_sd=np.full(len(data.envelopes[m][::ENVELOPE_STEP]), 0.01)
        )
        for m in (0, 1)
    ]
    noise = SimpleNamespace(of=lambda c: own[int(data.motion[c])])
    return SimpleNamespace(plant=Echo(), noise=noise, train=[0, 1], heldout=[2, 3])


def shown(search, after_is_before=False):
    before, after = named(point={}), named("viscous_drag", point={"k1": 0.01})
    loud, quiet = Verdict(0.0, {"torque": 40.0, "gap": 1.0}), Verdict(0.5, {"torque": 0.5, "gap": 1.0})
    after = before if after_is_before else after
    return pictures(Examination(None, search, before, after, loud, quiet))


TITLES = [
    "Envelope current in time", "Residual torque", "Orders and frequencies of the residual torque",
    "Residual phase currents by electrical angle", "Where in the actuator the residual stands out",
]  # fmt: skip


def test_a_report_of_an_actuator_shows_where_and_before_and_after(examined):
    alone, once = shown(examined, after_is_before=True), examined.plant.asked
    full = shown(examined)
    assert examined.plant.asked == 3 * once  # where nothing was found, nothing is drawn twice
    assert [p.title for p in full] == [p.title for p in alone] == TITLES
    assert all(p.png.startswith(b"\x89PNG") for p in full)
    assert all(a.png != b.png for a, b in zip(full[:4], alone[:4], strict=True))  # what was found is drawn


def test_temperature_is_drawn_where_it_varies(examined):
    data = examined.plant.data
    warm = SimpleNamespace(**{**vars(data), "has_temperature": True, "dT": np.arange(4.0), "n_cycles": 4})
    examined.plant.data = warm
    try:
        assert [p.title for p in shown(examined, after_is_before=True)][-1] == "Residual against temperature"
        warm.dT = np.zeros(4)
        assert [p.title for p in shown(examined, after_is_before=True)] == TITLES
    finally:
        examined.plant.data = data
