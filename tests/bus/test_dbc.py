"""The DBC is the single source: what it must say for everything else to be derived from it."""

import logging
import math
import warnings

import cantools
import pytest

from ema.bus import identifiers
from ema.bus.header import HEADER_SIGNALS
from ema.bus.span import SAMPLES_PER_FRAME, Span
from ema.core import resources
from ema.core.names import METHODS
from ema.core.status import Lapse, LogState, Reason, ServiceState, Status
from ema.effects import registry
from ema.log import schemas


@pytest.fixture(scope="module")
def database():
    return cantools.database.load_file(resources.dbc())


def test_it_loads_without_a_warning(caplog):
    with warnings.catch_warnings(), caplog.at_level(logging.WARNING):
        warnings.simplefilter("error")
        cantools.database.load_file(resources.dbc(), cache_dir=None)
    assert not caplog.records


def test_every_message_and_signal_says_what_it_is_and_in_which_unit(database):
    for message in database.messages:
        assert message.comment
        assert message.is_fd
        assert message.is_extended_frame
        assert message.senders
        assert message.length in (8, 12, 16, 20, 24, 32, 48, 64)
        for signal in message.signals:
            assert signal.comment
            assert not signal.unit or signal.comment.endswith(f"[{signal.unit}]")


def test_every_frame_begins_with_the_protection_header(database):
    for message in database.messages:
        layout = {s.name: (s.start, s.length, s.byte_order) for s in message.signals}
        assert [layout[name] for name in HEADER_SIGNALS] == [
            (0, 16, "little_endian"),
            (23, 8, "big_endian"),
            (31, 8, "big_endian"),
        ]


def test_identifiers_are_those_of_actuator_0_with_a_data_id_of_their_own(database):
    data_ids = set()
    for message in database.messages:
        fields = identifiers.parse(message.frame_id)
        assert message.frame_id < 1 << 29
        assert not message.frame_id >> 18 & 1  # reserved
        assert (fields.actuator, fields.rci, fields.lcl, fields.pvt) == (0, 0, 1, 1)
        assert fields.fid == {"Actuator": 100, "Monitor": 101, "Tester": 102}[message.senders[0]]
        data_ids.add(identifiers.data_id(message.frame_id))
    assert len(data_ids) == len(database.messages)


def choices(message, signal):
    return {int(k): str(v) for k, v in message.get_signal_by_name(signal).choices.items()}


def meaning(enum):
    return {member.value: member.name.lower() for member in enum}


def test_heartbeat_states_are_those_of_the_library(database):
    heartbeat = database.get_message_by_name("Heartbeat")
    assert choices(heartbeat, "state") == meaning(ServiceState)
    assert choices(heartbeat, "log_state") == meaning(LogState)
    assert choices(heartbeat, "reason") == meaning(Lapse)
    assert len(Lapse) <= database.get_message_by_name("Supervision").get_signal_by_name("reasons").length


def test_a_cycle_has_the_layout_that_its_span_counts_with(database):
    for name in ("CycleStart", "CycleEnd"):
        message = database.get_message_by_name(name)
        assert {s.name for s in message.signals} - set(HEADER_SIGNALS) == set(Span._fields)
        assert choices(message, "motion_kind") == {0: "chirp"}
    for name, series in {"PhaseCurrents": "i_a i_b i_c", "Motion": "theta_u theta_m theta_cmd"}.items():
        signals = {s.name for s in database.get_message_by_name(name).signals} - set(HEADER_SIGNALS)
        assert signals == {f"{stem}_{n}" for stem in series.split() for n in range(SAMPLES_PER_FRAME)}


def test_every_parameter_of_an_effect_has_a_number_and_units_are_si(database):
    listed = choices(database.get_message_by_name("EstimateNuisance"), "parameter").values()
    scalar = [e for e in registry().values() if "ema" in e.plants and not e.is_table]
    known = [f"{e.name}.{p.name}" for e in scalar for p in e.parameters]
    assert sorted(listed) == sorted(known)


def test_every_identifier_has_a_number(database):
    listed = choices(database.get_message_by_name("EstimateNuisance"), "method").values()
    assert sorted(listed) == sorted(METHODS)
    assert set(schemas.METHODS) <= set(METHODS)


def test_status_and_reasons_are_those_of_the_library(database):
    for method in schemas.METHODS:
        message = database.get_message_by_name(f"Estimate{method.capitalize()}")
        assert choices(message, "status") == meaning(Status)
        listed = message.get_signal_by_name("reason").comment.split(": ")[1].rstrip(".")
        assert listed.split(", ") == [reason.name for reason in Reason]
        assert [reason.value for reason in Reason] == [1 << n for n in range(len(Reason))]


def test_currents_lie_on_the_grid_of_a_12_bit_converter(database):
    scale = database.get_message_by_name("PhaseCurrents").get_signal_by_name("i_a_0").scale
    assert (60 / 4096 / scale).is_integer()
    assert scale <= 1e-3


def test_rotor_angle_fills_a_turn(database):
    scale = database.get_message_by_name("Motion").get_signal_by_name("theta_m_0").scale
    assert scale * 65536 == pytest.approx(2 * math.pi, rel=1e-15)
