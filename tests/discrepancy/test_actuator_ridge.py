"""A weaker magnet beside unequal shorts, recorded by a simulator of another hand: two minima, and the way between."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.foreign import record, truths
from ema.core.names import FAULTS
from ema.core.records import Record
from ema.discrepancy.actuator.examine import split
from ema.discrepancy.actuator.finding.ridge import sort_by_nearness, walk_ridge
from ema.discrepancy.actuator.finding.screening import Screened, probe
from ema.discrepancy.actuator.fitting.candidates import candidates
from ema.discrepancy.actuator.fitting.free import K_FREE
from ema.discrepancy.actuator.fitting.search import Search
from ema.discrepancy.actuator.reading.conditions import take_recorded_conditions
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.actuator.simulating.plant import EmaPlant

ALONE = dict(zip(FAULTS, (0.0643, 0.1001, 0.1367, 0.1221, 0.0953, 0.0117), strict=True))  # where faults alone end


@pytest.mark.slow
def test_a_magnet_is_found_between_none_of_the_shorts_and_all_of_them(shipped_plant):
    """Slopes had led from either end of the ridge to nothing: shorts stayed 0.037 too large, with no magnet named."""
    truth = truths()["flux_and_faults"]
    data = prepare(shipped_plant, [Record(record("flux_and_faults").cycles[:4])])
    plant = EmaPlant(take_recorded_conditions(shipped_plant, data.signals)[0], data)
    search = Search(plant, Noise(plant, ALONE), *split(data))
    by_name = {c.effect: c for c in reversed(candidates(plant.plant, data, []))}  # of saturation: by the square
    magnet, *others = probe(search, [by_name[name] for name in ("magnet_flux", "recorder_offset", "saturation")])
    model = search.model((), K_FREE, ALONE, None, 1)
    kept = sort_by_nearness(search, model, [Screened(0.0, c, {}) for c in (*others, magnet)])
    assert [s.candidate.effect for s in kept] == ["magnet_flux"]  # the others do nothing like three shorts
    stuck = search.model((magnet,), (*K_FREE, *magnet.frees), model.fit.point, None, 3)
    shorts = [name for name in FAULTS if name in magnet.faults]
    assert min(stuck.fit.point[name] - truth["k"][FAULTS.index(name)] for name in shorts) > 0.03
    found = walk_ridge(search, model, stuck, magnet, np.inf)
    assert found.heldout < stuck.heldout
    assert found.fit.point["magnet_flux.change"] == pytest.approx(truth["hidden"]["magnet_flux.change"], abs=0.004)
    for name, true in zip(FAULTS, truth["k"], strict=True):
        assert found.fit.point[name] == pytest.approx(true, abs=0.004)
