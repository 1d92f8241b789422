from __future__ import annotations

import numpy as np
import pytest

from ema import bundle
from ema.core import config, resources
from ema.identification.known_error import n_terms
from ema.models.actuator import Actuator


@pytest.fixture
def small_bundle(tmp_path):
    """A bundle of the right shapes with made-up numbers: what is checked here is the container."""
    plant = config.load(resources.config("actuator.yaml"), Actuator)
    rng = np.random.default_rng(1)
    size = {"n_t": plant.n_samples, "r": 4, "n_omega": 10, "n_f1": 2, "n_f2": 3, "n_k2": 4, "n_k6": 3, "n_levels": 3,
            "n_terms": n_terms(6)}  # fmt: skip
    arrays = {
        name: rng.standard_normal([size.get(n, n) for n in shape])  # type: ignore[arg-type]
        for name, shape in bundle.SHAPES.items()
    }
    arrays["schedule"] = np.arange(10) * 100
    for name, shape in bundle.SHAPES.items():
        if shape[-2:] == ("n_omega", "n_omega"):
            arrays[name] = np.broadcast_to(np.eye(10), arrays[name].shape)
    bundle.save(tmp_path / "made" / "bundle", plant, {}, arrays, builder_hash="", figures={})
    return bundle.load(tmp_path / "made" / "bundle")
