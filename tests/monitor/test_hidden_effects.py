"""An actuator that does what its bundle's plant does not: estimates are marked, and an event names the cycles."""

from __future__ import annotations

import pytest
from hidden_traffic import watched

from ema.core.status import Reason, Status
from ema.identification.unbounded import p_possible
from ema.monitor import Level

N = 6  # cycles


def flown(hidden, bundle, **flaws):
    return watched(bundle, hidden.cycles(hidden.Flaws(**flaws), N, 17, motions=(hidden.chirp(),)))


def is_wrong(estimate, k, level=0.999):
    """Whether a fault is outside its interval: of a backlash of 0.1 so coarse a bundle puts a tenth on other faults."""
    low, high = estimate.interval(level).T
    return bool((k < low).any() or (k > high).any())


@pytest.mark.parametrize("flaws", [{"cogging": 0.01}, {"viscous": 6e-5}], ids=["cogging", "viscous drag"])
def test_an_unmodelled_effect_puts_the_model_in_doubt(hidden, coarse_bundle, flaws):
    """From the third cycle that speaks against it; the event says which cycles, and what to do with them."""
    seen = flown(hidden, coarse_bundle, **flaws)
    assert len(seen.estimates) == N
    assert seen.doubted.all()
    (event,) = [e for e in seen.events if e.code == "model_in_doubt"]
    assert event.level is Level.WARNING
    assert "cycles 0, 1, 2" in event.text
    assert "ema discrepancy LOG --plant FILE --cycles 0,1,2" in event.text


@pytest.mark.parametrize("faults", [{}, {"k1": 0.05, "k4": 0.04}, {"k1": 0.3}, {"k2": 0.1}], ids=str)
def test_neither_a_sound_actuator_nor_a_faulty_one_is_doubted(hidden, coarse_bundle, faults):
    seen, k = flown(hidden, coarse_bundle, **faults), [faults.get(f"k{j}", 0.0) for j in range(1, 7)]
    assert sum(doubted and not is_wrong(e, k) for doubted, e in zip(seen.doubted, seen.estimates, strict=True)) <= 1
    assert not any(e.code == "model_in_doubt" for e in seen.events)
    assert not seen.alarms(k)


@pytest.mark.parametrize("flaws", [{"flux": 0.005}, {"inertia": -0.006}], ids=str)
def test_an_actuator_livelier_than_its_bundle_is_doubted_though_each_residual_fits(hidden, coarse_bundle, flaws):
    """It reads as shorts of less than none; the bounds put what they would explain on k6, which is 0.1."""
    seen = flown(hidden, coarse_bundle, k6=0.1, **flaws)
    k6 = [(float(e.k[5]), e.interval(0.95)[5, 1], e.status) for e in seen.estimates]
    assert all(high < 0.1 for _, high, _ in k6)  # wrong, by what each cycle tells alone
    assert sum(e.p_value > 1e-3 for e in seen.estimates) >= 2
    assert all(status is not Status.VALID for _, _, status in k6[2:])
    for n, e in enumerate(seen.estimates):  # from the first on that the cycles so far tell, not from the third
        told = p_possible([e.unbounded for e in seen.estimates[: n + 1]][-5:]) < 1e-3
        assert not (told and e.status is Status.VALID)
    assert any(e.code == "model_in_doubt" for e in seen.events)


def test_a_weaker_magnet_reads_as_three_shorts_that_are_marked_unseparable(hidden, coarse_bundle):
    """Its response and that of three equal shorts differ by less than a model is trusted (docs/nuisance.md)."""
    seen = flown(hidden, coarse_bundle, flux=-0.066)
    assert seen.alarms([0.0] * 6) == ["k3", "k4", "k5"]
    assert seen.doubted.sum() <= 1
    assert all(e.status is Status.DEGRADED and e.reasons & Reason.UNSEPARABLE for e in seen.estimates)
    event, *_ = [e for e in seen.events if e.code == "unseparable"]
    assert "k3 with k4 with k5" in event.text


def test_a_short_beside_a_weaker_magnet_is_marked_too(hidden, coarse_bundle):
    """Two of the three have not grown at all; what they read alike is the magnet's."""
    seen = flown(hidden, coarse_bundle, flux=-0.066, k4=0.06)
    assert all(e.status is Status.DEGRADED and e.reasons & Reason.UNSEPARABLE for e in seen.estimates)


@pytest.mark.parametrize("shorts", [{"k3": 0.06, "k5": 0.03}, {"k3": 0.02, "k4": 0.1, "k5": 0.14}], ids=str)
def test_shorts_that_are_not_alike_are_told_apart(hidden, coarse_bundle, shorts):
    seen = flown(hidden, coarse_bundle, **shorts)
    assert not any(e.reasons & Reason.UNSEPARABLE for e in seen.estimates)
    assert not any(e.code == "unseparable" for e in seen.events)
