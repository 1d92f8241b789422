"""Write tests/models/golden/cycle.csv again: `.venv/bin/python tools/golden_record.py`, then review the difference.

One cycle with several faults, every twentieth sample: envelope, user position, rotor angle.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ema.core import config, resources
from ema.models import hf
from ema.models.actuator import Actuator

PATH = Path(__file__).resolve().parents[1] / "tests" / "models" / "golden" / "cycle.csv"
K = (0.1, 0.2, 0.15, 0.05, 0.0, 0.1)
SEED = 20260101
EVERY = 20


def record() -> np.ndarray:
    """Columns t, envelope, θ_u, θ_m; shape (251, 4). [s, A, rad, rad]"""
    r = hf.simulate(config.load(resources.config("actuator.yaml"), Actuator), np.array(K), seeds=SEED)
    return np.column_stack([r.t, r.envelope[0], r.theta_u[0], r.theta_m[0]])[::EVERY]


if __name__ == "__main__":
    PATH.parent.mkdir(exist_ok=True)
    np.savetxt(
        PATH, record(), delimiter=",", fmt="%.6g", header="t [s],envelope [A],theta_u [rad],theta_m [rad]", comments=""
    )
    print(PATH)
