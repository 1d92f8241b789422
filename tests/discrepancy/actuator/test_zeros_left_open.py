"""A rotor angle whose zero is off, where a record does not tell how far the zeros of its sensors lie apart."""

from __future__ import annotations

import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.fitting.fit import misfit_at
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.actuator.simulating.plant import EmaPlant

TURNED = -0.035  # [rad electrical]
BESIDE = {
    "a gear that gives": (
        {"compliance": 1.05e-5, "user_damping": 30.0},
        {"gear_compliance.compliance": 1.05e-5, "gear_compliance.inertia": 0.6, "gear_compliance.damping": 0.0627},
    ),
    "a late position": ({"position_delay": 1.1e-3}, {"position_delay.time": 1.1e-3}),
}


@pytest.mark.slow
@pytest.mark.parametrize("beside", list(BESIDE))
def test_the_users_sensor_is_right_where_the_record_leaves_open_how_far_the_zeros_lie_apart(
    hidden, shipped_plant, beside
):
    """It was taken for as far off as the rotor's, so that neither error was seen: the truth left 14 times the noise."""
    flaws, truth = BESIDE[beside]
    cycles = hidden.cycles(hidden.Flaws(commutation=TURNED, **flaws), 2, 21, (hidden.chirp(),))
    data = prepare(shipped_plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(cycles)))])
    assert data.zero is None
    point = {"commutation_offset.angle": TURNED, **truth}
    plant = EmaPlant(shipped_plant, data)
    left, without = (misfit_at(plant, Noise(plant, at), at, [0, 1]) for at in (point, truth))
    assert left < 1.6
    assert without > 3.0
