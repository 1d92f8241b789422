import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ema.bus import header
from ema.bus.protection import GOOD, Check, Receiver, Sender, StreamState
from ema.bus.stream import MAX_AHEAD, MAX_MISSING, SILENCE_NS
from ema.core import frames as fr

OK, LOST, LATE, AGAIN = Check.OK, Check.SOME_LOST, Check.REORDERED, Check.REPEATED


@pytest.fixture
def sent(currents):
    return Sender().protect(currents(400))


def checks_of(codec, frames):
    receiver = Receiver(codec)
    return receiver.check(frames).tolist(), receiver


def test_an_undisturbed_stream_is_good_and_valid(codec, sent):
    checks, receiver = checks_of(codec, sent)
    assert checks == [OK] * 400
    (stream,) = receiver.streams.values()
    assert stream.machine.state is StreamState.VALID
    assert receiver.counts.n_good == 400


@pytest.mark.parametrize(
    ("order", "expected", "counted"),
    [
        ([0, 1, 4, 5], [OK, OK, LOST, OK], {"n_lost": 2, "n_good": 4}),
        ([0, 1, 1, 2, 0], [OK, OK, AGAIN, OK, AGAIN], {"n_repeated": 2, "n_good": 3}),
        ([0, 2, 1, 3], [OK, LOST, LATE, OK], {"n_reordered": 1, "n_lost": 0, "n_good": 4}),
        ([0, 3, 1, 1, 4], [OK, LOST, LATE, AGAIN, OK], {"n_reordered": 1, "n_lost": 1, "n_repeated": 1}),
        ([0, 300, 1, 2], [OK, Check.WRONG_COUNTER, OK, OK], {"n_wrong_counter": 1, "n_lost": 0, "n_good": 3}),
    ],
    ids=["lost", "repeated", "reordered", "late twice", "stray"],
)
def test_the_sequence_tells_what_happened(codec, sent, order, expected, counted):
    checks, receiver = checks_of(codec, sent[order])
    assert checks == expected
    for name, value in counted.items():
        assert getattr(receiver.counts, name) == value


@pytest.mark.parametrize(
    ("order", "expected"),
    [
        ([0, 300, 301, 302], [OK, Check.WRONG_COUNTER, OK, OK]),
        ([200, 201, 0, 1, 2], [OK, OK, Check.WRONG_COUNTER, OK, OK]),
    ],
    ids=["sender jumped", "sender restarted"],
)
def test_a_new_sequence_is_followed_after_a_silence(codec, sent, order, expected):
    frames = sent[order]
    far_off = np.abs(np.diff(order, prepend=order[0])) > MAX_AHEAD
    frames["t_ns"] = np.cumsum(np.where(far_off, SILENCE_NS + 1_000_000, 1_000_000))
    checks, receiver = checks_of(codec, frames)
    assert checks == expected
    assert receiver.counts.n_wrong_counter == 1


def test_a_new_sequence_without_a_silence_is_followed_when_it_goes_on(codec, sent):
    frames = sent[[0, *range(200, 300)]]
    frames["t_ns"] = 100_000 * np.arange(101)
    checks, _ = checks_of(codec, frames)
    assert checks == [OK] + [Check.WRONG_COUNTER] * (MAX_AHEAD + 1) + [OK] * (100 - MAX_AHEAD - 1)


def test_old_frames_sent_again_do_not_pull_the_sequence_away(codec, sent):
    """Not even a run of them that is a valid sequence in itself."""
    frames = sent[[*range(300), *range(40), *range(300, 400), *range(30)]]
    frames["t_ns"] = 100_000 * np.arange(len(frames))
    checks, receiver = checks_of(codec, frames)
    assert [n for n, check in enumerate(checks) if check == OK] == [*range(300), *range(340, 440)]
    assert receiver.counts.n_lost == 0


def test_old_frames_sent_again_in_a_pause_are_left_when_the_sequence_goes_on(codec, sent):
    order = [*range(200), *range(40), *range(200, 400)]
    frames = sent[order]
    frames["t_ns"] = 1_000_000 * np.arange(len(frames)) + np.where(np.arange(len(frames)) >= 200, 2 * SILENCE_NS, 0)
    checks, receiver = checks_of(codec, frames)
    assert checks[240:] == [OK] * 200
    assert receiver.counts.n_lost == 0


def test_batch_boundaries_do_not_matter(codec, sent):
    rng = np.random.default_rng(5)
    order = np.sort(rng.choice(400, 350, replace=False))
    order[50], order[51] = order[51], order[50]
    frames = sent[order]
    frames["data"][rng.choice(350, 9), 20] ^= 1
    whole, receiver = checks_of(codec, frames)
    pieces = Receiver(codec)
    assert np.concatenate([pieces.check(part) for part in np.array_split(frames, 23)]).tolist() == whole
    assert pieces.counts == receiver.counts


@pytest.mark.parametrize("byte", range(64))
def test_any_damaged_byte_is_found(codec, sent, byte):
    sent[5]["data"][byte] ^= 1 << byte % 8
    checks, receiver = checks_of(codec, sent[:20])
    assert checks[5] == Check.CRC_ERROR
    assert receiver.counts.n_crc_error == 1
    assert receiver.counts.n_lost == 1


def test_a_frame_of_another_actuator_does_not_pass_as_this_ones(codec, sent):
    """Masquerading: the Data ID is part of the CRC."""
    sent["id"] += 4
    checks, _ = checks_of(codec, sent[:3])
    assert checks == [Check.CRC_ERROR] * 3


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("length", 63),
        ("length", 0),
        ("flags", int(fr.FrameFlag.EXTENDED)),
        ("flags", int(fr.FrameFlag.FD)),
        ("flags", int(fr.FrameFlag.EXTENDED | fr.FrameFlag.REMOTE)),
    ],
)
def test_wrong_length_or_format_has_its_own_count(codec, sent, field, value):
    sent[3][field] = value
    checks, receiver = checks_of(codec, sent[:5])
    assert checks[3] == Check.WRONG_LENGTH
    assert (receiver.counts.n_wrong_length, receiver.counts.n_crc_error) == (1, 0)


def test_only_the_wanted_messages_and_actuators_are_received(codec, sent):
    assert Receiver(codec, messages=["Supply"]).check(sent[:2]).tolist() == [Check.FOREIGN] * 2
    assert Receiver(codec, actuators=[4]).check(sent[:2]).tolist() == [Check.FOREIGN] * 2
    assert Receiver(codec, actuators=[3]).check(sent[:2]).tolist() == [OK] * 2


def test_sequences_wrap(codec, currents):
    sender = Sender()
    frames = currents(100)
    sender.skip(int(frames["id"][0]), 65500)
    sender.protect(frames)
    assert header.sequence(frames)[[0, 35, 36, 99]].tolist() == [65500, 65535, 0, 63]
    order = [*range(36), 37, 36, *range(38, 100)]
    checks, _ = checks_of(codec, frames[order])
    assert checks == [*[OK] * 36, LOST, LATE, *[OK] * 62]


def test_errors_make_a_stream_invalid_and_good_frames_valid_again(codec, sent):
    sent["data"][20:24, 30] ^= 0xFF
    receiver = Receiver(codec)
    states = []
    for n in range(60):
        receiver.check(sent[n : n + 1])
        (stream,) = receiver.streams.values()
        states.append(stream.machine.state)
    assert states[0] is StreamState.INIT
    assert states[19] is StreamState.VALID
    assert states[23] is StreamState.INVALID
    assert states[59] is StreamState.VALID


def test_a_silence_by_the_frames_own_time_begins_the_stream_anew(codec):
    receiver = Receiver(codec)
    t_ns = np.array([0, 1, 2, 3, 4, 12, 13, 14]) * 10**8  # 0.8 s of silence, 0.5 s are allowed
    frames = Sender().protect(codec.encode("Supply", 0, {"u_dc": [48.0] * 8, "temp_w": 20.0}, t_ns))
    receiver.check(frames[:5])
    (stream,) = receiver.streams.values()
    assert stream.machine.state is StreamState.VALID
    receiver.check(frames[5:6])
    assert stream.machine.state is StreamState.INIT
    receiver.check(frames[6:])
    assert stream.machine.state is StreamState.VALID
    assert receiver.heard == {int(frames["id"][0]): 8}


def test_a_sender_restarted_within_a_time_out_is_followed_after_it(codec):
    receiver = Receiver(codec)
    values = {"u_dc": [48.0] * 5, "temp_w": 20.0}
    receiver.check(Sender().protect(codec.encode("Supply", 0, values, np.arange(5) * 10**8)))
    again = Sender().protect(codec.encode("Supply", 0, values, (6 + np.arange(5)) * 10**8))
    assert receiver.check(again[:2]).tolist() == [AGAIN] * 2
    assert receiver.check(again[2:]).tolist() == [AGAIN] * 2 + [OK]  # the last one: 0.6 s after the last good one


def test_a_long_loss_is_bounded_in_memory(codec, sent):
    receiver = Receiver(codec)
    receiver.check(sent[:: MAX_AHEAD + 1])
    receiver.check(Sender().protect(sent.copy())[::MAX_AHEAD])
    (stream,) = receiver.streams.values()
    assert len(stream._missing) <= MAX_MISSING


@settings(deadline=None)
@given(st.data())
def test_arbitrary_frames_never_break_the_receiver(codec, any_frames, data):
    receiver = Receiver(codec)
    for _ in range(2):
        frames = data.draw(any_frames)
        checks = receiver.check(frames)
        assert checks.size == frames.size
        for message, part in codec.split(frames[checks <= GOOD]):
            message.decode(part)


def test_an_actuator_that_was_restarted_is_followed_at_once(codec):
    """Its rare frames as well: their numbers are only a little behind, as if old ones were sent again."""
    receiver = Receiver(codec, actuators={3})

    def flight(start_ns):
        sender, second = Sender(), 1_000_000_000
        cycles = [
            codec.encode(name, 3, values, start_ns + n * second + delay)
            for n in range(4)
            for name, values, delay in (
                ("CycleStart", SPAN, 0),
                ("Supply", {"u_dc": 48.0, "temp_w": 20.0}, 1000),
                ("CycleEnd", SPAN, 400_000_000),
                ("Supply", {"u_dc": 48.0, "temp_w": 20.0}, 800_000_000),
            )
        ]
        return sender.protect(np.concatenate(cycles))

    first, second = flight(0), flight(5_000_000_000)
    assert (receiver.check(first) == Check.OK).all()
    assert (receiver.check(first[-4:]) == Check.REPEATED).all()  # without a silence they are old ones
    assert (receiver.check(second) <= GOOD).all()
    assert receiver.counts.n_lost == 0


SPAN = {"cycle": 1, "first_current": 0, "first_motion": 0, "n_samples": 5001, "period": 1e-4, "motion_kind": 0}
