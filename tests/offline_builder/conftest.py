from __future__ import annotations

import pytest
from ema_offline_builder.config import Builder

from ema.models.actuator import Actuator


@pytest.fixture(scope="session")
def plant(shipped_plant) -> Actuator:
    return shipped_plant


@pytest.fixture(scope="session")
def tiny() -> Builder:
    """A builder of a few hundred runs: too coarse for an aircraft, enough for a contract."""
    levels = {
        "k1_levels": [0.2, 0.5],
        "k2_levels": [0.1, 0.3, 0.6],
        "phase_levels": [0.1, 0.3],
        "k6_levels": [0.2, 0.5],
    }
    return Builder.model_validate(
        {
            "plant": "actuator.yaml",
            "seed": 7,
            "campaign": {"n_snapshots": 60, "k_max": 0.3},
            "heldout": {"n": 40, "k_max": [0.05, 0.3]},
            "n_seeds": 8,
            "n_noise": 60,
            "n_start": 60,
            "jacobian": {"steps": [0.05]},
            "library": {**levels, "degree_f1": 2, "degree_f2": 2},
        }
    )
