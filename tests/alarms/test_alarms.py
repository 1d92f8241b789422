"""When alarms come and go: by the lower end, with persistence and hysteresis, and only from estimates that count."""

from __future__ import annotations

import json

import numpy as np
import pytest

from ema.alarms import Action, Alarms, AlarmSettings, Command, Warmth, in_order
from ema.core import config
from ema.core.errors import ConfigError
from ema.core.status import AlarmLevel, AlarmState, Reason, Status

T0 = 1_741_943_700_000_000_000
SECOND = 1_000_000_000


def changes_of(alarms, estimates, cause):
    return [(c.since_cycle, c.level, c.state) for e in estimates for c in alarms.estimate(e) if c.cause == cause]


def test_a_step_is_told_with_the_third_cycle(settings, judged):
    alarms = Alarms(settings, [0])
    told = changes_of(alarms, [judged(n, k3=0.0 if n < 10 else 0.3) for n in range(20)], "k3")
    assert told == [(12, AlarmLevel.ALARM, AlarmState.ACTIVE)]


def test_the_lower_end_is_judged_not_the_value(settings, judged):
    limit = settings.faults["k3"].watch
    sure, unsure = Alarms(settings, [0]), Alarms(settings, [0])
    assert changes_of(sure, [judged(n, k3=limit + 0.01, sd=0.002) for n in range(10)], "k3")
    assert not changes_of(unsure, [judged(n, k3=limit + 0.01, sd=0.01) for n in range(10)], "k3")


def test_two_cycles_of_five_are_no_alarm(settings, judged):
    estimates = [judged(n, k1=0.3 if n % 5 < 2 else 0.0) for n in range(40)]
    assert not changes_of(Alarms(settings, [0]), estimates, "k1")


def test_a_value_that_hovers_about_the_setpoint_does_not_chatter(settings, judged):
    rng = np.random.default_rng(3)
    limit = settings.faults["k1"].watch
    sd = 0.1 * limit  # the hysteresis is two of them
    alarms = Alarms(settings, [0])
    for n in range(2000):
        alarms.estimate(judged(n, k1=limit + settings.deviations * 0.002 + rng.normal(0.0, sd)))
    told = changes_of(alarms, [judged(2000 + n, k1=limit + 0.004 + rng.normal(0.0, sd)) for n in range(2000)], "k1")
    assert len(told) <= 4


@pytest.mark.parametrize("status", [Status.INVALID, Status.NOT_ESTIMATED])
def test_no_alarm_of_a_fault_on_an_invalid_estimate_but_one_that_there_is_none(settings, judged, status):
    alarms = Alarms(settings, [0])
    told = [c for n in range(10) for c in alarms.estimate(judged(n, k1=0.9, status=status))]
    assert {c.cause for c in told} == {"no_estimate"}


def test_degraded_estimates_count_as_configured(settings, judged):
    estimates = [judged(n, k1=0.3, status=Status.DEGRADED, reasons=Reason.MODEL_IN_DOUBT) for n in range(10)]
    choosy = settings.model_copy(update={"not_counted": ["model_in_doubt"]})
    assert changes_of(Alarms(settings, [0]), estimates, "k1")
    assert not changes_of(Alarms(choosy, [0]), estimates, "k1")
    assert changes_of(Alarms(choosy, [0]), estimates, "model_in_doubt")


def test_cycles_before_a_break_do_not_count(settings, judged):
    alarms = Alarms(settings, [0])
    before, after = (judged(n, k1=0.3) for n in (0, 1)), judged(10_000, k1=0.3)
    assert not changes_of(alarms, [*before, after], "k1")


def test_growth_is_told_with_the_time_left(settings, judged):
    alarms = Alarms(settings, [0])
    rng = np.random.default_rng(4)
    per_hour, level = 0.06, settings.faults["k4"].alarm
    told = []
    for n in range(1800):
        k4 = 0.01 + per_hour * n / 3600.0 + rng.normal(0.0, 0.002)
        told += [c for c in alarms.estimate(judged(n, k4=max(k4, 0.0))) if c.cause.startswith("k")]
    assert {c.cause for c in told} == {"k4_rate", "k4_life"}
    at_end = next(c for c in alarms.standing(T0) if c.cause == "k4_life").measure
    true = (level - 0.01 - per_hour * 0.5) / per_hour
    assert at_end.low < true < at_end.high
    assert at_end.high - at_end.low < 0.5 * true


def test_what_follows_the_temperature_is_no_growth_until_the_temperature_stays(settings, judged):
    """Magnets of a winding that warms by 40 K in 20 min look like a short of 0.05; then k4 grows by itself."""
    rng = np.random.default_rng(8)

    def flown(grows):
        alarms, told = Alarms(settings, [0]), []
        for n in range(3600):
            temp_w = 20.0 + min(40.0, n / 30.0)
            k4 = 0.00125 * (temp_w - 20.0) + grows * max(n - 1200, 0) / 3600.0 + rng.normal(0.0, 0.002)
            alarms.hear(Warmth(T0 + n * SECOND - 1, 0, temp_w))
            told += [c.cause for c in alarms.estimate(judged(n, k4=max(k4, 0.0))) if "_" in c.cause]
        return set(told), alarms.standing(T0)

    assert flown(0.0)[0] == set()
    told, standing = flown(0.05)
    assert told == {"k4_rate", "k4_life"}
    (rate,) = (c.measure for c in standing if c.cause == "k4_rate")
    assert rate.low < 0.05 < rate.high


def test_a_fault_that_does_not_grow_has_no_rate(settings, judged):
    rng = np.random.default_rng(5)
    alarms = Alarms(settings, [0])
    told = [c for n in range(1000) for c in alarms.estimate(judged(n, k4=0.03 + rng.normal(0.0, 0.002)))]
    assert not told


def test_operators(settings, judged):
    alarms = Alarms(settings, [0])
    for n in range(5):
        alarms.estimate(judged(n, k1=0.3))

    def do(action, t_ns, duration=0.0):
        return [c.state for c in alarms.command(Command(t_ns, action, 0, "k1", duration))]

    assert do(Action.CLEAR, T0) == []  # the condition holds
    assert do(Action.ACK, T0) == [AlarmState.ACKNOWLEDGED]
    assert do(Action.SHELVE, T0 + 4 * SECOND, 10.0) == [AlarmState.SHELVED]
    for n in range(5, 14):
        assert not alarms.estimate(judged(n, k1=0.3))
    assert [c.state for c in alarms.estimate(judged(14, k1=0.3))] == [AlarmState.ACTIVE]
    for n in range(15, 20):
        alarms.estimate(judged(n))
    assert [c.state for c in alarms.standing(T0)] == [AlarmState.LATCHED_CLEARED]
    assert do(Action.CLEAR, T0) == [AlarmState.INACTIVE]
    assert not alarms.standing(T0)


def test_shelving_ends_at_the_longest_allowed(settings, judged):
    alarms = Alarms(settings, [0])
    (change,) = alarms.command(Command(T0, Action.SHELVE, 0, "k1", 1e6))
    assert change.shelved_until_ns - T0 == settings.longest_shelving * 3600 * SECOND


def test_a_restart_changes_nothing(settings, judged):
    rng = np.random.default_rng(6)
    estimates = [judged(n, k1=max(0.0, 0.001 * n + rng.normal(0, 0.01)), k6=0.1) for n in range(200)]
    one, two = Alarms(settings, [0]), Alarms(settings, [0])
    told, again = [], []
    for n, e in enumerate(estimates):
        told += one.estimate(e)
        again += two.estimate(e)
        if n == 7:
            for alarms in (one, two):
                alarms.command(Command(e.t_ns, Action.SHELVE, 0, "k6", 30.0))
        if n % 10 == 3:
            stored = json.loads(json.dumps(two.snapshot(), allow_nan=False))
            two = Alarms(settings, [0])
            two.restore(stored)
    assert [repr(c) for c in told] == [repr(c) for c in again]
    assert len(told) > 4


def test_other_settings_keep_the_alarms_but_not_what_led_to_them(settings, judged):
    alarms = Alarms(settings, [0, 1])
    for n in range(5):
        alarms.estimate(judged(n, k1=0.3))
        alarms.estimate(judged(n, actuator=1, k2=0.3))
    fewer = Alarms(settings.model_copy(update={"deviations": 3.0}), [0])
    fewer.restore(alarms.snapshot())
    assert [(c.actuator, c.cause) for c in fewer.standing(T0)] == [(0, "k1")]


@pytest.mark.parametrize("stored", [{}, {"version": 99}, {"version": 1}, {"version": 1, "points": [[0, "k1", {}, []]]}])
def test_a_damaged_snapshot_is_refused_whole(settings, judged, stored):
    alarms = Alarms(settings, [0])
    for n in range(5):
        alarms.estimate(judged(n, k1=0.3))
    before = alarms.snapshot()
    with pytest.raises(ValueError, match=r"snapshot|version"):
        alarms.restore(stored)
    assert alarms.snapshot() == before


def test_commands_come_in_the_order_of_time(judged):
    commands = [Command(T0 + n * SECOND // 2, Action.ACK, 0, "k1") for n in (1, 4)]
    items = [judged(n) for n in range(3)]
    order = [type(x).__name__[0] for x in in_order(commands, items)]
    assert "".join(order) == "JCJCJ"


def test_supervision_follows_heartbeats_and_commands_a_second_later(settings):
    alarms = Alarms(settings, [0])
    held = {(None, "log"): True, (0, "silent"): True}
    told = alarms.supervise(T0, held)
    assert {(c.actuator, c.cause, c.state) for c in told} == {
        (None, "log", AlarmState.ACTIVE),
        (0, "silent", AlarmState.ACTIVE),
    }
    assert alarms.command(Command(T0 + 1, Action.ACK, None, "log")) == []
    assert alarms.supervise(T0 + SECOND // 2, held) == []
    assert [c.state for c in alarms.supervise(T0 + 2 * SECOND, held)] == [AlarmState.ACKNOWLEDGED]
    assert {(c.cause, c.state) for c in alarms.supervise(T0 + 3 * SECOND, {})} == {
        ("log", AlarmState.INACTIVE),
        ("silent", AlarmState.LATCHED_CLEARED),
    }


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"faults": {}}, "faults"),
        ({"persistence": {"m": 2, "n": 5}}, "more than half"),
        ({"not_counted": ["bad_weather"]}, "bad_weather"),
        ({"colour": "red"}, "colour"),
        ({"supervision": {"log": "loud"}}, "supervision.log"),
    ],
)
def test_a_wrong_file_is_refused_in_a_line(settings, change, says):
    with pytest.raises(ConfigError, match=says):
        config.validate(settings.model_dump() | change, AlarmSettings, "alarms.yaml")
