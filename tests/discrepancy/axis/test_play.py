"""Play of a gear in records of another simulator: its size, and what is behind it."""

from __future__ import annotations

import numpy as np
import pytest
import strange

from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.finding.play import play_candidate
from ema.discrepancy.fitting import fit
from ema.models.axis_config import RotaryAxis

AXIS = strange.Axis()


def suggested(kind, seed):
    plant = AxisPlant(RotaryAxis.model_validate(strange.plant(AXIS)), [strange.record(kind, AXIS, seed)], n_threads=1)
    plant.between = "held"
    blocks = range(0, len(plant.blocks), 2)
    without = fit(plant, plant.base, {f.name: f.start for f in plant.base}, blocks)
    return plant, without, play_candidate(plant, without.point, blocks)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 8])
def test_the_size_of_a_play_and_what_is_behind_it_are_found(seed):
    """Its teeth are springs with a damper that pulls too: nearly the library's."""
    plant, without, found = suggested("gap", seed)
    _, (half, share, _) = strange.draw(strange.GAP, AXIS, np.random.default_rng(seed))
    fitted = fit(plant, [*plant.base, *found.free], {**without.point, **found.starts[0]}, without.blocks)
    assert fitted.point["gear_play.gap"] == pytest.approx(2.0 * half, rel=0.1)
    assert fitted.point["gear_play.inertia"] == pytest.approx(share * AXIS.J, rel=0.1)
    again = play_candidate(plant, without.point, without.blocks)
    assert again is not None
    assert again.starts == found.starts


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["nothing", "current_ripple"])
def test_where_there_is_none_none_is_suggested_or_a_tiny_one(kind):
    plant, _, found = suggested(kind, 5)
    travel = max(float(np.ptp(w.position)) for w in plant.windows)
    assert found is None or found.starts[0]["gear_play.gap"] < 0.01 * travel
