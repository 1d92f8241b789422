"""Cycles without a fault."""

from __future__ import annotations

import numpy as np
import pytest

from ema.core.status import Reason
from ema.identification import Measurement, identifier
from ema.models import hf


@pytest.mark.parametrize("method", ["linear", "lf2", "lf1"])
def test_a_healthy_actuator_is_no_reason_to_doubt_a_model(coarse_bundle, method):
    """Its mean envelope is known to the builder, so every model must tell it, whatever it gets wrong of faults."""
    n, made = 60, identifier(method, coarse_bundle)
    runs = hf.simulate(coarse_bundle.plant, np.zeros((n, 6)), seeds=7000 + np.arange(n)).envelope
    estimates = [made.estimate(Measurement.complete(i[coarse_bundle.schedule], np.zeros(2))) for i in runs]
    doubted = np.mean([bool(e.reasons & Reason.MODEL_IN_DOUBT) for e in estimates])
    print(f"{method}: {doubted:.1%} of {n} healthy cycles doubted")
    assert doubted < 0.06
    assert np.abs(np.mean([e.k for e in estimates], axis=0)).max() < 0.005
