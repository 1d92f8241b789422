"""An eccentricity in another direction than the plant's is doubted, not told as a fault (docs/decisions/0005)."""

from __future__ import annotations

import numpy as np
import pytest

from ema.core.status import Reason
from ema.identification import Measurement, identifier
from ema.models.envelope import envelope


def estimates(hidden, bundle, method, **flaws):
    cycles = hidden.cycles(hidden.Flaws(**flaws), 3, 3, motions=(hidden.chirp(),))
    GR = bundle.plant.transmission.GR
    for c in cycles:
        i = envelope(np.array([c["i_a"], c["i_b"], c["i_c"]]), bundle.plant.control.rate)
        start = np.array([c["theta_u"][0], c["theta_m"][0] / GR])
        yield identifier(method, bundle).estimate(Measurement.complete(i[bundle.schedule], start))


@pytest.mark.parametrize("method", ["linear", "lf2"])
@pytest.mark.parametrize("phi", [1.0, np.pi / 2, np.pi])
def test_another_direction_puts_the_model_in_doubt(hidden, coarse_bundle, method, phi):
    assert all(e.reasons & Reason.MODEL_IN_DOUBT for e in estimates(hidden, coarse_bundle, method, k6=0.1, phi=phi))


@pytest.mark.parametrize("method", ["linear", "lf2"])
def test_the_plants_own_direction_does_not(hidden, coarse_bundle, method):
    for e in estimates(hidden, coarse_bundle, method, k6=0.1):
        assert not e.reasons & Reason.MODEL_IN_DOUBT
        assert e.k[5] == pytest.approx(0.1, abs=0.03)
