"""Effects that the balance of torque shows beside each other, of which neither alone foretells much."""

from __future__ import annotations

import pytest

from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import RotaryAxis


def test_what_the_balance_needs_is_begun_where_it_has_it_with_the_freedom_that_the_library_gives(support):
    cable = support("cable_bench")
    bench = cable.Bench(G=0.5, spring=0.3, span=2.0)
    plant = AxisPlant(RotaryAxis.model_validate(cable.plant(bench)), [cable.record(bench, 0)])
    seen = {c.key: c for c in plant.seen_together({f.name: f.start for f in plant.base})}
    assert set(seen) == {"pendulum", "spring_load", "constant_load"}  # where the spring is at rest
    assert seen["spring_load"].starts[0]["spring_load.stiffness"] == pytest.approx(0.3, rel=0.05)
    assert seen["pendulum"].starts[0]["pendulum.amplitude"] == pytest.approx(0.5, rel=0.05)
    assert all({f.name for f in c.free} <= c.starts[0].keys() for c in seen.values())


def test_drag_that_is_not_the_plant_files_is_begun_beside_the_laws_where_that_has_it_as_known(support):
    cable = support("cable_bench")
    bench = cable.Bench(G=0.5, span=2.0)
    record = cable.record(bench, 0)
    for fitted, names in (([], {"viscous_drag", "pendulum"}), (["C"], {"pendulum"})):
        file = {**cable.plant(bench), "J": bench.J, "C": 0.25 * bench.C, "fitted": fitted}
        plant = AxisPlant(RotaryAxis.model_validate(file), [record])
        seen = {c.key: c for c in plant.seen_together({f.name: f.start for f in plant.base})}
        assert names <= set(seen)
        assert ("viscous_drag" in seen) == (not fitted)
        if not fitted:
            more = seen["viscous_drag"].starts[0]["viscous_drag.coefficient"]
            assert more == pytest.approx(0.75 * bench.C, rel=0.2)
