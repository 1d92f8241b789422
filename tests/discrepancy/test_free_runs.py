"""What free runs confirm of an effect that the whitened residual asks for."""

from __future__ import annotations

import numpy as np
import pytest
from toy_plant import N_BLOCKS, N, Toy

from ema.discrepancy import examine
from ema.discrepancy.free_runs import trust_by_free_runs
from ema.discrepancy.parts import list_parts
from ema.discrepancy.selection import fit_base, fit_with_each

SIZE = 0.3
SEEDS = range(40)


class Running(Toy):
    """A toy whose free runs differ from its residual: effect a moves them by `moved`, and a part of it is there."""

    def __init__(self, seed, there, moved=1.0, size=SIZE):
        super().__init__(seed, a=size)
        rng = np.random.default_rng((seed, 1))
        self.moved = moved * rng.standard_normal((N_BLOCKS, N))
        self.run = rng.standard_normal((N_BLOCKS, N)) + there * size * self.moved

    def free_run_errors(self, point, blocks):
        return [self.run[j] - point.get("a.size", 0.0) * self.moved[j] for j in blocks]


def trust(plant, before=0.95):
    plain = fit_base(plant)
    model = fit_with_each(plant, plain, plant.candidates, lambda key: None)["a"]
    return trust_by_free_runs(plant, plain, model, before)


def test_parts_hold_every_block_once():
    blocks = [j for _, _, of in list_parts(Running(0, there=1.0)) for j in of]
    assert sorted(blocks) == list(range(N_BLOCKS))


def test_what_is_there_stays_trusted():
    trusts = [trust(Running(seed, there=1.0)) for seed in SEEDS]
    assert sum(t > 0.94 for t in trusts) >= 38
    assert min(trusts) > 0.5


@pytest.mark.parametrize("there", [0.0, 0.3])
def test_what_free_runs_move_by_and_do_not_show_is_doubted(there):
    trusts = [trust(Running(seed, there, size=0.6)) for seed in SEEDS]
    assert sum(t < 0.1 for t in trusts) >= 38


@pytest.mark.parametrize("moved", [0.0, 0.02])
def test_free_runs_that_hardly_move_say_nothing_against_an_effect(moved):
    trusts = [trust(Running(seed, there=0.0, moved=moved)) for seed in SEEDS]
    assert min(trusts) > 0.9


def test_a_law_of_nearly_the_right_form_is_borne_out():
    assert sum(trust(Running(seed, there=0.83, size=0.6)) > 0.94 for seed in SEEDS) >= 36


def test_free_runs_make_nothing_surer():
    assert max(trust(Running(seed, there=1.0), before=0.3) for seed in SEEDS) == pytest.approx(0.3)


def test_an_effect_that_free_runs_contradict_is_told_as_considered_and_not_named():
    outcome = examine.examine(Running(3, there=0.0, size=0.6))
    assert outcome.effects == []
    assert "a" in [row["name"] for row in outcome.lost]
