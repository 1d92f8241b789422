"""Sizes of a law between the members of its family, on a motion that is known on paper."""

from __future__ import annotations

import numpy as np
import pytest
from balance_on_paper import PLAIN, acting, motion, rows

from ema.discrepancy.axis.balance.laws.laws import laws
from ema.discrepancy.axis.balance.regressing.members import draw_members, fit_sizes, members_around
from ema.discrepancy.axis.balance.regressing.regression import regress

M = motion()
FALLING = [law for law in laws(M, linear=False) if law.family == "stribeck"]
MIDDLE = FALLING[len(FALLING) // 2].among


def made_by(law, noise=0.0, seed=0):
    return rows(M, torque=0.04 * law.columns(M, acting(M))[0], noise=noise, seed=seed)


@pytest.mark.parametrize("shape", [-1.0, -0.6, 0.0, 0.5, 1.0])
@pytest.mark.parametrize("step", [-2.3, 0.4])
def test_both_sizes_of_a_law_are_found_between_the_members(shape, step):
    """Between 1/(1 + x²) and an exponential less is left of a Gaussian's half: the way to the truth is not downhill."""
    truth = MIDDLE.member(np.array([MIDDLE.at[0] + step, shape]))
    made = made_by(truth)
    best = fit_sizes(made, regress(made, PLAIN, []), FALLING)
    assert best.among.at == pytest.approx(truth.among.at, abs=0.03)


def test_members_on_either_side_of_the_truth_leave_least_equally_often():
    before, after, far = (MIDDLE.moved(np.array([by, 0.0])) for by in (-0.02, 0.02, 3.0))
    n = np.zeros(3)
    for seed in range(30):
        made = made_by(MIDDLE.member(MIDDLE.at), noise=0.003, seed=seed)
        n += np.bincount(draw_members(made, regress(made, PLAIN, []), [before, after, far], 100), minlength=3) / 30
    assert n[:2] == pytest.approx([50.0, 50.0], abs=20.0)
    assert n[2] == 0.0


def test_where_the_second_size_is_not_seen_its_members_reach_from_end_to_end():
    made = made_by(MIDDLE.member(MIDDLE.at), noise=0.01)
    model = regress(made, PLAIN, [])
    near = members_around(made, model, fit_sizes(made, model, FALLING), FALLING)
    shapes = {law.among.at[1] for law in near}
    assert min(shapes) == -1.0
    assert max(shapes) == 1.0
    assert len({law.key for law in near}) == len(near)
