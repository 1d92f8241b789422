"""The way of a search from faults alone: one effect in the place of several of them, before others are added."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from ema.discrepancy.actuator.finding import paths


def answer(name, is_noise):
    return SimpleNamespace(name=name, effects=(name,) if name else ()), SimpleNamespace(is_noise=is_noise)


@pytest.mark.parametrize(("leaves_noise", "expected"), [(True, "magnet_flux"), (False, "")])
def test_one_effect_for_several_faults_is_gone_on_from_if_it_leaves_noise_by_its_own(
    monkeypatch, leaves_noise, expected
):
    """By that of faults alone it had left 1.3 of noise, a winding beside shorts less; and the noise is put back."""

    def simplify(search, before, model, v, alike, as_well):
        search.noise = "its own"
        alike.append(("k3 and k4 alike",))
        return answer("magnet_flux", leaves_noise)

    monkeypatch.setattr(paths, "simplify", simplify)
    search, (before, v), alike = SimpleNamespace(noise="of faults"), answer("", False), []
    made, w = paths.put_one_in_place_of_faults(search, before, v, alike)
    assert (made.name, w.is_noise) == (expected, leaves_noise)
    assert search.noise == ("its own" if leaves_noise else "of faults")
    assert alike == ([("k3 and k4 alike",)] if leaves_noise else [])


def test_faults_that_leave_noise_stay():
    before, v = answer("", True)
    assert paths.put_one_in_place_of_faults(None, before, v, []) == (before, v)
