"""One effect for what several faults have in common, and effects without what they do not need: on fits made up."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from ema.discrepancy.actuator.finding.simpler import (
    drop_common_faults,
    drop_constant_parts,
    drop_faults,
    keep_alike,
    simplify,
    take_resolver_zero,
)
from ema.discrepancy.actuator.fitting.candidates import Candidate
from ema.discrepancy.actuator.fitting.free import K_FREE, free
from ema.discrepancy.actuator.fitting.model import Model

NOISE, NO_NOISE = SimpleNamespace(is_noise=True, p_value=0.5), SimpleNamespace(is_noise=False, p_value=1e-6)


def candidate(effect, *linear):
    return Candidate(effect, tuple(free(f"{effect}.{name}") for name in linear), {}, linear, (0.1,) * len(linear))


FLUX = candidate("magnet_flux", "change")
WARM = candidate("magnet_flux", "change", "per_kelvin")
DRAG = candidate("viscous_drag", "coefficient")
OF_FLUX = FLUX.faults  # a weaker magnet is the same torque at the same current as shorts


def fitted(effects, point, heldout=1.0, frees=None, sd=None):
    frees = (*K_FREE, *(f for c in effects for f in c.frees)) if frees is None else tuple(frees)
    fit = SimpleNamespace(point=point, free=frees, columns={}, sd=sd or {}, misfit=heldout)
    return Model(tuple(effects), fit, heldout)


class Search:
    """Fits leave what `leaves` says of them; nothing is simulated."""

    def __init__(
        self, leaves=lambda model: 1.0, zero=0.0, is_open=False, verdict=NOISE, tried=(), at_minimum=lambda model: model
    ):
        sensors = SimpleNamespace(lvdt_step=1e-6)
        motor, gear = SimpleNamespace(p=2), SimpleNamespace(GR=500.0)
        plant = SimpleNamespace(sensors=sensors, motor=motor, transmission=gear)
        self.plant = SimpleNamespace(plant=plant, data=SimpleNamespace(zero=zero), leaves_zero_open=is_open)
        self.leaves, self.noise, self._verdict, self.made, self.tried = leaves, None, verdict, [], list(tried)
        self.at_minimum = at_minimum

    def model(self, effects, frees, start, known, n_iterations):
        made = fitted(effects, dict(start), frees=frees)
        made.heldout = self.leaves(made)
        self.made.append(made)
        return made

    def instead(self, model, effect, rival):
        return rival

    def left_more(self, model, other, noises):
        return self.leaves(model) - self.leaves(other)

    def verdict(self, model):
        return self._verdict

    def say(self, text):
        pass


def n_free(model):
    return len(model.fit.free)


SHORTS = {**dict.fromkeys(OF_FLUX, 0.05), OF_FLUX[-1]: 0.08, "magnet_flux.change": -0.02}


def test_a_magnet_can_be_taken_for_several_shorts():
    assert len(OF_FLUX) == 3


def test_what_faults_have_in_common_is_taken_from_all_of_them():
    made = drop_common_faults(Search(), fitted((FLUX,), SHORTS), FLUX)
    point, free_now = made.fit.point, {f.name for f in made.fit.free}
    assert [point[name] for name in OF_FLUX] == pytest.approx([0.0, 0.0, 0.03])
    assert free_now & set(OF_FLUX) == {OF_FLUX[-1]}
    nothing_common = {**SHORTS, OF_FLUX[0]: 0.004}
    assert drop_common_faults(Search(), fitted((FLUX,), nothing_common), FLUX) is None
    assert drop_common_faults(Search(), fitted((DRAG,), {"k1": 0.1, "viscous_drag.coefficient": 1e-5}), DRAG) is None


def test_faults_go_where_their_effect_does_as_well_without_them():
    before, model, alike = fitted((), {}, 9.0), fitted((FLUX,), SHORTS), [()]
    found, v = drop_faults(Search(), before, model, NOISE, alike)
    assert v is NOISE
    assert n_free(found) == n_free(model) - 2
    assert alike == [(f"{OF_FLUX[0]} and {OF_FLUX[1]} alike",)]


def test_faults_stay_where_more_is_left_without_them_or_the_model_is_far_from_right():
    before, model = fitted((), {}, 9.0), fitted((FLUX,), SHORTS)
    needs_all = Search(lambda m: 1.0 if n_free(m) == n_free(model) else 1.2)
    assert drop_faults(needs_all, before, model, NOISE, [()])[0] is model
    far = fitted((FLUX,), SHORTS, heldout=4.0)
    untouched = Search()
    assert drop_faults(untouched, before, far, NO_NOISE, [()])[0] is far
    assert untouched.made == []
    no_longer_noise = Search(verdict=NO_NOISE)
    assert drop_faults(no_longer_noise, before, model, NOISE, [()])[0] is model


def test_where_much_is_left_nothing_simpler_is_looked_for():
    before, far = fitted((), {}, 9.0), fitted((DRAG,), {"viscous_drag.coefficient": 1e-5}, heldout=4.0)
    assert simplify(Search(), before, far, NO_NOISE, [()], [])[0] is far


@pytest.mark.parametrize(("constant", "gone"), [(0.01, True), (0.05, False)])
def test_a_constant_part_that_may_be_nothing_goes(constant, gone):
    """Its deviation is 0.01: one deviation may be nothing, five may not."""
    point = {"magnet_flux.change": constant, "magnet_flux.per_kelvin": -1e-3}
    model = fitted((WARM,), point, sd={"magnet_flux.change": 0.01, "magnet_flux.per_kelvin": 1e-5})
    found, _ = drop_constant_parts(Search(), model, NOISE)
    assert (found.effects[0].linear == ("per_kelvin",)) == gone
    assert (found.fit.point["magnet_flux.change"] == 0.0) == gone


def test_a_constant_part_stays_where_it_is_missed():
    point = {"magnet_flux.change": 0.01, "magnet_flux.per_kelvin": -1e-3}
    model = fitted((WARM,), point, sd={"magnet_flux.change": 0.01, "magnet_flux.per_kelvin": 1e-5})
    missed = Search(lambda m: 1.0 if "magnet_flux.change" in {f.name for f in m.fit.free} else 1.2)
    assert drop_constant_parts(missed, model, NOISE)[0] is model
    plain = fitted((FLUX,), SHORTS, sd={"magnet_flux.change": 1.0})
    assert drop_constant_parts(Search(), plain, NOISE)[0] is plain


def test_a_zero_of_two_sensors_may_be_the_commutation():
    model = fitted((), {})
    alike = []
    found, _ = take_resolver_zero(Search(zero=1e-4), model, NOISE, alike)
    assert found.names == ("commutation_offset",)
    assert found.fit.point["commutation_offset.angle"] == pytest.approx(2 * 500.0 * 1e-4, rel=0.01)
    assert alike == [("a zero of theta_u",)]
    better, alike = Search(lambda m: 1.0 if m.names else 1.3, zero=1e-4), []
    take_resolver_zero(better, model, NOISE, alike)
    assert alike == [()]  # nothing else would do


@pytest.mark.parametrize(("is_open", "known"), [(False, 3e-7), (True, 2e-6)])
def test_a_zero_that_a_model_told_is_known_less_well_than_one_that_the_record_shows(is_open, known):
    """Held within 0.3 mrad electrical a commutation was told 9 deviations off, since the model's zero was 0.9 off."""
    found, _ = take_resolver_zero(Search(zero=1e-4, is_open=is_open), fitted((), {}), NOISE, [])
    (angle,) = (f for f in found.fit.free if f.name == "commutation_offset.angle")
    assert (angle.low, angle.high) == pytest.approx((1e3 * (1e-4 - known), 1e3 * (1e-4 + known)))


def test_a_zero_within_a_step_of_the_sensor_needs_no_cause():
    model = fitted((), {})
    assert take_resolver_zero(Search(zero=1e-7), model, NOISE, [])[0] is model
    assert take_resolver_zero(Search(zero=1e-4), model, NO_NOISE, [])[0] is model
    worse = Search(lambda m: 1.2 if m.names else 1.0, zero=1e-4)
    assert take_resolver_zero(worse, model, NOISE, [])[0] is model


def test_a_rival_stays_one_only_if_it_does_as_well_beside_what_was_found_later():
    model = fitted((FLUX, DRAG), SHORTS)
    as_well = fitted((candidate("inertia", "change"),), {}, heldout=1.0)
    no_longer = fitted((candidate("current_gain", "gain_a"),), {}, heldout=1.5)
    search = Search(tried=[as_well, no_longer])
    assert keep_alike(search, model, 0, ("inertia", "current_gain", "viscous_drag")) == ("inertia",)
    assert keep_alike(search, model, 1, ("current_gain",)) == ("current_gain",)  # the last was held against them


def test_a_rival_near_noise_is_one_by_what_it_leaves_at_its_minimum():
    """A position that is late with a record that is late is a late controller with a later record, almost."""
    model = fitted((FLUX, DRAG), SHORTS)
    near = fitted((candidate("inertia", "change"),), {}, heldout=1.2)
    far = fitted((candidate("current_gain", "gain_a"),), {}, heldout=3.0)
    there = {id(near): fitted(near.effects, {}, heldout=1.0)}  # what is far is not asked for
    search = Search(tried=[near, far], at_minimum=lambda m: there[id(m)])
    assert keep_alike(search, model, 0, ("inertia", "current_gain")) == ("inertia",)
    stays = Search(tried=[near], at_minimum=lambda m: m)
    assert keep_alike(stays, model, 0, ("inertia",)) == ()
