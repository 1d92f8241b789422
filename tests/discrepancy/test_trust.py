"""How far an effect stands out: beside laws of another form, and where folds have other parameters."""

from __future__ import annotations

import numpy as np

from ema.discrepancy.fitting import Fit
from ema.discrepancy.plant import Block, Candidate, Free
from ema.discrepancy.progress import Progress
from ema.discrepancy.rounds import State, leave_out
from ema.discrepancy.selection import Tried
from ema.discrepancy.trust import drop_unlikely, leans_in_a_fold

N_BLOCKS, N = 12, 200
# what effects do to the residual, over noise: less than a sixth of the larger one's is its form
LARGE, SMALL = 3.0, 0.3


def line(order, value):
    """A line of torque, and a fit of it."""
    free = Free(f"cogging:{order}.cos", "N m", -1.0, 1.0, 0.1, 0.1)
    candidate = Candidate("cogging", "cogging", (free,), ({free.name: 0.1},))
    return candidate, Fit((free,), {free.name: value}, [], np.eye(1), (0,), 1.0, np.eye(1))


def tried(*lines):
    candidates, fits = zip(*lines, strict=True)
    return Tried(candidates[:1], fits, tuple((c,) for c in candidates), ())


def test_a_line_that_another_fold_has_at_another_order_is_looked_up_there():
    assert not leans_in_a_fold(tried(line(16, 0.2), line(12, 0.3)), 0)


def test_a_law_that_ends_at_its_bound_in_one_fold_leans():
    assert leans_in_a_fold(tried(line(16, 0.2), line(12, 1.0)), 0)


class Columns:
    """A plant whose effects are columns, by block; `acting` is what its record holds beside noise."""

    noise_uncertainty = 0.0
    noise_uncertainties = (0.0, 0.0, 0.0)
    noisier = None
    base = ()
    structure = candidates = errors = describe = describe_structure = None

    def __init__(self, columns, acting):
        self.blocks = [Block("record", stretch=j) for j in range(N_BLOCKS)]
        self.columns = columns
        self.y = np.random.default_rng(1).standard_normal((N_BLOCKS, N)) + acting

    def residuals(self, points, blocks):
        return [
            [(self.y[j] - sum(x * self.columns[name][j] for name, x in point.items()))[None] for j in blocks]
            for point in points
        ]

    def is_of_sensor(self, candidate):
        return False

    def free_run_errors(self, point, blocks):
        return [r[0] for r in self.residuals([point], blocks)[0]]

    def tried(self, *names):
        """The model with these effects, each as large as its column is."""
        candidates = [Candidate(n, n, (Free(n, "1", -5.0, 5.0, 1.0, 0.1),), ({n: 1.0},)) for n in names]
        point = {n: 1.0 for n in names}
        held_out = self.residuals([point], range(N_BLOCKS))[0]
        free = tuple(c.free[0] for c in candidates)
        fit = Fit(free, point, held_out, np.eye(len(free)), tuple(range(N_BLOCKS)), 1.0, np.eye(len(free)))
        return Tried(tuple(candidates), (fit, fit), (tuple(candidates),) * 2, tuple(held_out))


def named(small, acting):
    """What stays of a large effect with a small one beside it, and what was considered."""
    large = LARGE * np.random.default_rng(2).standard_normal((N_BLOCKS, N))
    columns = {"large": large, "small": small(large)}
    plant = Columns(columns, large + acting(large, columns["small"]))
    both = plant.tried("large", "small")
    rounds = [({"large": both}, plant.tried("small")), ({"small": both}, plant.tried("large"))]
    state = State(plant.tried(), both, rounds, [])
    trust, _ = drop_unlikely(plant, state, Progress())
    return [c.key for c in state.model.accepted], trust, [row["name"] for row in state.unlikely]


def test_a_small_effect_that_looks_like_no_other_law_is_as_sure_as_it_stands_out():
    other = SMALL * np.random.default_rng(3).standard_normal((N_BLOCKS, N))
    _, trust, unlikely = named(lambda large: other, lambda large, small: small)
    assert trust["small"] > 0.9
    assert unlikely == []


def test_what_another_law_would_make_were_it_stronger_in_some_blocks_is_told_as_considered():
    late = (np.arange(N_BLOCKS) >= N_BLOCKS // 2)[:, None]
    stays, _, unlikely = named(lambda large: 0.1 * late * large, lambda large, small: small)
    assert stays == ["large"]
    assert unlikely == ["small"]


def like_in_part(large):
    """Half of it is what the large one would make were it stronger in late blocks, half its own."""
    late = (np.arange(N_BLOCKS) >= N_BLOCKS // 2)[:, None]
    own = np.random.default_rng(3).standard_normal((N_BLOCKS, N))
    return SMALL * (late * large / LARGE + np.sqrt(0.5) * own)


def test_the_form_of_another_law_would_leave_what_does_not_look_like_the_effect():
    _, trust, unlikely = named(like_in_part, lambda large, small: small)
    assert trust["small"] > 0.9
    assert unlikely == []


def test_beside_a_rest_an_effect_that_looks_like_another_law_in_part_may_be_its_form():
    rest = 0.2 * np.random.default_rng(4).standard_normal((N_BLOCKS, N))
    _, trust, _ = named(like_in_part, lambda large, small: small + rest)
    assert trust["small"] < 0.7


def test_what_stays_is_judged_without_what_was_dropped():
    """Either of two that are nearly alike does most alone, so neither is missed much while the other is there."""
    rng = np.random.default_rng(2)
    large = LARGE * rng.standard_normal((N_BLOCKS, N))
    columns = {"large": large, "twin": 0.5 * large + SMALL * rng.standard_normal((N_BLOCKS, N))}
    rest = np.sqrt(0.3) * rng.standard_normal((N_BLOCKS, N))
    plant = Columns(columns, sum(columns.values()) + rest)
    both = plant.tried("large", "twin")
    rounds = [({name: both}, leave_out(plant, both, {j})) for j, name in enumerate(columns)]
    state = State(plant.tried(), both, rounds, [])
    trust, _ = drop_unlikely(plant, state, Progress())
    assert [row["name"] for row in state.unlikely] == ["twin"]
    assert trust["large"] > 0.9
