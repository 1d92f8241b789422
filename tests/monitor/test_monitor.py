"""From frames to estimates: recovery, validity, determinism, slower identifiers, the model in doubt."""

from __future__ import annotations

import numpy as np
import pytest

from ema.core.errors import ConfigError
from ema.core.status import Reason, Status
from ema.monitor import Event, Identified, SampledEnvelope


def linear(outputs):
    return [out for out in outputs if isinstance(out, Identified) and out.estimate.method == "linear"]


def err(k, k_true):
    return np.linalg.norm(k - k_true) / np.sqrt(6)


def facts(outputs):
    """Everything of the outputs that could differ."""
    rows = []
    for out in outputs:
        if isinstance(out, Identified):
            e = out.estimate
            arrays = (e.k, e.sd, e.covariance, e.residual, np.array([e.chi2, e.p_value]))
            rows.append(
                (out.t_ns, out.actuator, out.cycle, e.method, e.status, e.reasons, *map(np.ndarray.tobytes, arrays))
            )
        elif isinstance(out, SampledEnvelope):
            rows.append(
                (out.t_ns, out.actuator, out.cycle, *(x.tobytes() for x in (out.t, out.measured, out.model, out.sd)))
            )
        else:
            rows.append(out)
    return rows


def test_estimates_follow_a_growing_fault(bench, fly, growing):
    flight = fly(**growing)
    answers = bench.linear(flight)
    assert [a.cycle for a in answers] == [cycle.number for cycle, _ in flight]
    for answer, (cycle, _) in zip(answers, flight, strict=True):
        assert answer.estimate.status is Status.VALID
        assert err(answer.estimate.k, cycle.k[0]) < 0.5 * max(err(0, cycle.k[0]), 0.02)
        assert (answer.estimate.sd > 0).all()


def test_ten_cycles_without_reset_are_as_good_as_the_first(bench, fly, shipped_plant):
    k = {"k1": 0.03, "k2": 0.04, "k3": 0.02}
    flight = fly(n_cycles=10, seed=3, actuators=[{"faults": k}])
    starts = np.array([cycle.response.theta_m[0, 0] for cycle, _ in flight])
    assert np.abs(starts[1:] - starts[0]).min() > 0.01  # each goes on from where the last one stopped
    assert np.unique(starts).size == 10
    errors = [err(a.estimate.k, flight[0][0].k[0]) for a in bench.linear(flight)]
    assert len(errors) == 10
    assert max(errors[1:]) < 0.02


@pytest.mark.parametrize("batch", [1, 50, 5000])
def test_the_same_frames_give_the_same_answers_bit_for_bit(bench, fly, growing, batch):
    bad = {"drop": 0.001, "repeat": 0.005, "corrupt": 0.001, "reorder": 0.005}
    flight = fly(**growing, disturbances=bad)
    slower = {"lf2": {"every": "2 s"}}
    assert facts(bench.outputs(flight, slower=slower)) == facts(bench.outputs(flight, batch=batch, slower=slower))


def test_the_size_of_batches_does_not_matter_while_the_model_is_doubted(bench, fly):
    odd = {"n_cycles": 6, "seed": 5, "actuators": [{"effects": {"viscous_drag": {"coefficient": 2e-4}}}]}
    whole = bench.outputs(fly(**odd), batch=5000)
    assert any(isinstance(out, Event) for out in whole)
    assert facts(whole) == facts(bench.outputs(fly(**odd), batch=50))


def test_a_gap_between_the_scheduled_points_degrades_and_one_at_a_point_makes_invalid(bench, fly, growing):
    flight = fly(**growing)
    frames = np.concatenate([f for _, f in flight])
    currents = bench.places(frames, "PhaseCurrents")
    schedule = bench.bundle.schedule
    distance = np.abs(schedule[:, None] - (np.arange(5001) + 0.5)).min(axis=0)
    far = int(distance[20:-20].argmax() + 20) // 10
    assert distance[10 * far + 5] > 40
    whole = bench.linear(frames)
    degraded = bench.linear(np.delete(frames, currents[far]))[0].estimate
    assert (degraded.status, degraded.reasons) == (Status.DEGRADED, whole[0].estimate.reasons | Reason.LOST_FRAMES)
    assert np.abs(degraded.k - whole[0].estimate.k).max() < 2e-3
    invalid = bench.linear(np.delete(frames, currents[schedule[7] // 10]))[0].estimate
    assert invalid.status is Status.INVALID
    assert (
        invalid.reasons & (Reason.LOST_FRAMES | Reason.GAP_AT_SCHEDULE) == Reason.LOST_FRAMES | Reason.GAP_AT_SCHEDULE
    )


def test_a_cycle_without_currents_is_not_estimated(bench, fly, growing):
    frames = np.concatenate([f for _, f in fly(**growing)])
    silent = bench.outputs(np.delete(frames, bench.places(frames, "PhaseCurrents")[:501]))
    first = next(out for out in silent if isinstance(out, Identified))
    assert first.estimate.status is Status.NOT_ESTIMATED
    assert np.isnan(first.estimate.k).all()
    envelope = next(out for out in silent if isinstance(out, SampledEnvelope))
    assert np.isnan(envelope.measured).all()


def test_damage_that_leaves_the_data_whole_changes_no_estimate(bench, fly, growing):
    """Repeated, late, foreign, malformed and forged frames: seen, counted, and without influence."""
    flight = fly(**growing)
    frames = np.concatenate([f for _, f in flight])
    rng = np.random.default_rng(4)
    forged = frames[rng.integers(0, frames.size, 300)].copy()
    forged["data"][:, 4:] = rng.integers(0, 256, (300, 60))
    short = frames[rng.integers(0, frames.size, 100)].copy()
    short["length"] //= 2
    foreign = frames[rng.integers(0, frames.size, 100)].copy()
    foreign["id"] = rng.integers(0, 1 << 29, 100) | 3
    strange = np.concatenate([forged, short, foreign])
    rng.shuffle(strange)
    places = rng.integers(0, frames.size, strange.size)
    strange["t_ns"] = frames["t_ns"][places]
    dirty = np.insert(frames, places, strange)
    dirty = np.repeat(dirty, 1 + (rng.random(dirty.size) < 0.03))
    clean, disturbed = bench.linear(frames), bench.linear(dirty)
    for a, b in zip(clean, disturbed, strict=True):
        assert np.array_equal(a.estimate.k, b.estimate.k)
        assert b.estimate.status is Status.VALID
        assert b.estimate.reasons & Reason.CORRUPT_FRAMES


def test_the_end_of_a_cycle_is_foreseen_by_the_currents_it_lacks(bench, fly, growing):
    frames = fly(**growing)[0][1]
    monitor, currents = bench.monitor(), bench.places(frames, "PhaseCurrents")
    (end,) = bench.places(frames, "CycleEnd")
    soon = {}
    for begin in range(0, frames.size, 7):
        monitor.update(frames[begin : begin + 7])
        n_left = np.count_nonzero(currents >= begin + 7) if begin + 7 <= end else None
        soon.setdefault(n_left, []).append(monitor.ends_within(9.5e-3))
    assert not any(soon.pop(None))  # it has ended
    for n_left, foreseen in soon.items():
        assert foreseen == [n_left <= 9] * len(foreseen)  # a millisecond each


def test_actuators_on_one_bus_do_not_influence_each_other(bench, fly):
    flight = fly(n_cycles=2, actuators=[{"number": n} for n in (3, 7, 63)])
    together = {(a.actuator, a.cycle): a.estimate.k for a in bench.linear(flight, 3, 7, 63)}
    assert len(together) == 6
    for number in (3, 7, 63):
        for answer in bench.linear(flight, number):
            assert np.array_equal(answer.estimate.k, together[number, answer.cycle])


def test_slower_identifiers_are_due_by_the_time_of_the_frames(bench, fly, growing):
    flight = fly(**growing)
    outputs = bench.outputs(flight, slower={"lf2": {"every": "2 s"}})
    chosen = [o.cycle for o in outputs if isinstance(o, Identified) and o.estimate.method == "lf2"]
    assert chosen == [0, 2, 4]  # the flight begins at an even second
    late = [o for o in bench.outputs(flight[1:], slower={"lf2": {"every": "2 s"}}) if isinstance(o, Identified)]
    assert [o.cycle for o in late if o.estimate.method == "lf2"] == [1, 2, 4]


def test_a_slower_identifier_gets_the_first_usable_cycle(bench, fly, growing):
    flight = fly(**growing)
    frames = np.concatenate([f for _, f in flight])
    gone = bench.places(frames, "PhaseCurrents")[bench.bundle.schedule[3] // 10]
    outputs = bench.outputs(np.delete(frames, gone), slower={"lf2": {"every": "2 s"}})
    chosen = [o.cycle for o in outputs if isinstance(o, Identified) and o.estimate.method == "lf2"]
    assert chosen == [1, 2, 4]


def test_an_unknown_identifier_is_refused(bench):
    with pytest.raises(ConfigError, match=r"monitor\.slower: identifier 'lf9' is unknown; known: .*lf2"):
        bench.monitor(slower={"lf9": {"every": 1}})


def test_the_envelope_is_given_beside_its_model(bench, fly, growing):
    outputs = bench.outputs(fly(**growing))
    shown = [o for o in outputs if isinstance(o, SampledEnvelope)]
    assert [o.cycle for o in shown] == list(range(6))
    for out in shown:
        assert np.array_equal(out.t, bench.bundle.t[bench.bundle.schedule])
        assert np.abs((out.measured - out.model) / out.sd).max() < 6


def test_a_current_at_the_end_of_its_converter_degrades(bench, fly, growing):
    flight = fly(**growing, noise=False)
    frames = np.concatenate([f for _, f in flight])
    message = bench.codec.messages["PhaseCurrents"]
    one = bench.places(frames, "PhaseCurrents")[100]
    values = message.decode(frames[one : one + 1])
    values["i_a"][0, 3] = 30.0
    frames["data"][one, 4:] = bench.codec.encode("PhaseCurrents", 0, values)["data"][0, 4:]
    _sign(frames[one : one + 1])
    first = bench.linear(frames)[0].estimate
    assert first.status is Status.DEGRADED
    assert first.reasons & Reason.SATURATED


def _sign(frames):
    from e2e.p05 import e2e_p05_protect

    from ema.bus.identifiers import data_id

    data = bytearray(frames["data"][0, : frames["length"][0]].tobytes())
    e2e_p05_protect(data, data_id(int(frames["id"][0])), increment_counter=False)
    frames["data"][0, : len(data)] = np.frombuffer(data, np.uint8)


def test_another_actuator_than_the_bundle_knows_puts_the_model_in_doubt(bench, fly, growing):
    """Twice the viscous drag is no fault of the six: the residuals show it, and the estimates say so."""
    odd = {"n_cycles": 6, "seed": 5, "actuators": [{"effects": {"viscous_drag": {"coefficient": 2e-4}}}]}
    outputs = bench.outputs(fly(**odd))
    events = [o for o in outputs if isinstance(o, Event)]
    assert [e.code for e in events if e.text.startswith("linear")] == ["beyond_linear"]
    assert "cycles 0, 1, 2 are larger" in events[0].text
    (doubt,) = [e for e in events if e.text.startswith("lf2")]
    assert doubt.code == "model_in_doubt"
    assert doubt.text.endswith("ema discrepancy LOG --plant FILE --cycles 0,1,2")
    last = linear(outputs)[-1].estimate
    assert last.reasons & Reason.MODEL_IN_DOUBT
    assert last.status is Status.DEGRADED
    assert not any(isinstance(o, Event) for o in bench.outputs(fly(**growing)))


def test_a_large_fault_is_not_taken_for_a_wrong_model(bench, fly):
    """A short far beyond the linear range: LF2 is asked, follows it, and nobody doubts the model."""
    shorted = {"n_cycles": 8, "seed": 5, "actuators": [{"faults": {"k3": 0.2}}]}
    outputs = bench.outputs(fly(**shorted))
    assert "model_in_doubt" not in [o.code for o in outputs if isinstance(o, Event)]
    assert not any(o.estimate.reasons & Reason.MODEL_IN_DOUBT for o in linear(outputs))
    asked = [o for o in outputs if isinstance(o, Identified) and o.estimate.method == "lf2"]
    assert asked
    assert np.median([o.estimate.k[2] for o in asked]) == pytest.approx(0.2, abs=0.03)


def test_an_actuator_that_was_restarted_is_monitored_from_its_first_cycle(bench, fly, growing):
    frames = np.concatenate([f for _, f in fly(**growing)])
    again = frames.copy()
    again["t_ns"] += np.uint64(8_000_000_000)
    outputs = bench.outputs(np.concatenate([frames, again]))
    assert [(a.cycle, a.estimate.status) for a in linear(outputs)] == [(n, Status.VALID) for n in [*range(6)] * 2]
    (event,) = [o for o in outputs if isinstance(o, Event)]
    assert event.text == "cycle 0 follows cycle 5: the actuator has restarted"
