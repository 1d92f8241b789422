import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ema.bus.header import sequence
from ema.bus.interface import open_bus, parse
from ema.bus.keys import MAC_BYTES, Keyring
from ema.bus.load import frame_time
from ema.bus.nodes import Node
from ema.bus.protection import Check, Receiver, Sender
from ema.bus.sealer import Sealer
from ema.bus.sessions import Sessions
from ema.bus.verifier import PATIENCE_NS, Verifier
from ema.core import frames as fr

KEY = bytes(range(16))
RING = Keyring({None: [KEY]})
OTHER = Keyring({None: [bytes(16)]})
NOW = 1_790_000_000 * 10**9
SECOND = 10**9


@pytest.fixture
def sessions(tmp_path):
    return Sessions(tmp_path / "sessions")


@pytest.fixture
def flight(codec, currents):
    """22 frames of currents, then the end of the cycle, one to a millisecond."""
    values = dict.fromkeys(codec.messages["CycleEnd"].fields, 0)
    frames = np.concatenate([currents(22), codec.encode("CycleEnd", 3, values)])
    frames["t_ns"] = NOW + np.arange(frames.size) * 10**6
    return Sender().protect(frames)


@pytest.fixture
def sealer(codec, sessions):
    return Sealer(codec, RING, sessions)


def sealed(sealer, frames):
    """The frames in their order, with the seals between them."""
    out = []
    for n in range(frames.size):
        made = sealer.add(frames[n : n + 1])
        made["t_ns"] = frames["t_ns"][n]
        out += [frames[n : n + 1], made]
    return np.concatenate(out)


def acquainted(verifier, sealer, frames, now_ns=0):
    """The verifier hears of the sealer's node and asks, and is answered."""
    hello = sealed(sealer, frames[-1:])
    verifier.feed(hello, int(hello["t_ns"][-1]))
    asked = verifier.ask(now_ns)
    answered = sealer.hear(asked, now_ns)
    verifier.feed(answered, int(hello["t_ns"][-1]))
    verifier.feed(fr.empty(0), 2**62)
    return asked, answered


@pytest.fixture
def verifier(codec, sealer, flight):
    made = Verifier(codec, RING)
    acquainted(made, sealer, flight)
    return made


def judged(verifier, frames, patience=SECOND):
    """What passes a receiver, frame by frame, and what it refuses."""
    out = [verifier.feed(frames[n : n + 1], int(frames["t_ns"][n])) for n in range(frames.size)]
    return parted(np.concatenate([*out, verifier.feed(fr.empty(0), int(frames["t_ns"].max()) + patience)]))


def parted(frames):
    is_refused = (frames["flags"] & fr.FrameFlag.REFUSED) != 0
    refused = frames[is_refused].copy()
    refused["flags"] &= ~np.uint8(fr.FrameFlag.REFUSED)
    return frames[~is_refused], refused


def forged(frame, change=1):
    """Another frame in the same place, with a correct CRC."""
    frame = frame.copy()
    frame["data"][0, 20] ^= change
    sender = Sender()
    sender.skip(int(frame["id"][0]), int(sequence(frame)[0]))
    return sender.protect(frame)


def is_seal(codec, frames):
    return np.array([codec.find(i).name.endswith("Seal") for i in frames["id"].tolist()], bool)


def test_genuine_frames_pass_in_their_order_and_seals_are_taken_out(codec, sealer, verifier, flight):
    on_bus = sealed(sealer, flight)
    assert on_bus.size == flight.size + 6  # 4 x 5 + 2 currents, 1 end
    passed, refused = judged(verifier, on_bus, patience=0)
    assert np.array_equal(passed, flight)
    assert refused.size == 0


def test_the_end_of_a_cycle_does_not_wait(sealer, verifier, flight):
    on_bus = sealed(sealer, flight)
    assert verifier.feed(on_bus, int(on_bus["t_ns"][-1])).size == flight.size


def test_a_sender_that_is_not_known_is_asked_and_passes_only_then(codec, sealer, flight):
    verifier = Verifier(codec, RING)
    passed, refused = judged(verifier, sealed(sealer, flight))
    assert (passed.size, refused.size) == (0, flight.size)
    asked = verifier.ask(0)
    assert [codec.find(i).name for i in asked["id"].tolist()] == ["MonitorChallenge"]
    assert verifier.ask(SECOND - 1).size == 0, "once a second"
    answer = sealer.hear(asked, 0)
    assert [codec.find(i).name for i in answer["id"].tolist()] == ["ActuatorSession"]
    assert verifier.feed(answer, NOW).size == 0
    passed, _ = judged(verifier, sealed(sealer, flight))
    assert np.array_equal(passed, flight)


def test_another_key_passes_nothing(codec, sealer, flight):
    verifier = Verifier(codec, OTHER)
    acquainted(verifier, sealer, flight)
    passed, refused = judged(verifier, sealed(sealer, flight))
    assert passed.size == 0
    assert np.array_equal(refused, flight)


def test_a_frame_changed_with_a_correct_crc_is_refused_alone(sealer, verifier, flight):
    on_bus = sealed(sealer, flight)
    other = forged(on_bus[2:3])
    passed, refused = judged(verifier, np.concatenate([on_bus[:2], other, on_bus[2:]]))
    assert np.array_equal(passed, flight)
    assert np.array_equal(refused, other)


def test_the_receiver_counts_a_forged_frame_as_refused_and_a_damaged_one_as_damaged(codec, sealer, verifier, flight):
    """Neither moves the sequence: nothing is lost by it."""
    on_bus = sealed(sealer, flight)
    damaged = on_bus[2:3].copy()
    damaged["data"][0, 20] ^= 1
    frames = np.concatenate([on_bus[:2], forged(on_bus[2:3]), damaged, on_bus[2:]])
    receiver = Receiver(codec)
    checks = receiver.check(verifier.feed(frames, NOW + SECOND))
    assert np.count_nonzero(checks == Check.REFUSED) == 1
    counts = receiver.counts
    assert (counts.n_refused, counts.n_crc_error, counts.n_lost, counts.n_good) == (1, 1, 0, flight.size)


def test_a_lost_frame_costs_no_other_and_a_lost_seal_its_five(sealer, verifier, flight):
    on_bus = sealed(sealer, flight)
    first = on_bus.copy()
    passed, _ = judged(verifier, np.delete(first, 3))
    assert np.array_equal(passed, np.delete(flight, 3))
    on_bus = sealed(sealer, flight)
    passed, refused = judged(verifier, np.delete(on_bus, 5))
    assert np.array_equal(passed, flight[5:])
    assert np.array_equal(refused, flight[:5])


@pytest.mark.parametrize("ahead", [0, 10, 5000], ids=["same numbers", "next ones", "far ahead"])
def test_a_flood_of_forged_frames_delays_nothing_and_each_costs_one_mac_at_most(codec, sealer, verifier, flight, ahead):
    """Twenty forged ones before each frame: a genuine one is through as soon as its seal is there, and in order."""
    on_bus, passed, before, n_received = sealed(sealer, flight), [], verifier.n_trials, 0
    seals = is_seal(codec, on_bus)
    for n in range(on_bus.size):
        flood = np.repeat(flight[n % flight.size : n % flight.size + 1], 20)
        Sender().protect(flood)
        flood["t_ns"] = on_bus["t_ns"][n]
        flood["data"][:, 2] += np.uint8(ahead % 256)
        flood["data"][:, 3] += np.uint8(ahead // 256)
        flood["data"][:, 20] ^= 1 + np.arange(20, dtype=np.uint8)
        n_received += flood.size + 1
        passed.append(parted(verifier.feed(np.concatenate([flood, on_bus[n : n + 1]]), 0))[0])
        assert passed[-1].size == 0 or seals[n]
        assert verifier.n_trials - before <= n_received
    assert np.array_equal(np.concatenate(passed), flight)


def test_a_forged_seal_costs_one_mac_and_changes_nothing(codec, sealer, verifier, flight, sessions):
    """Of a session far ahead, or the genuine one with anything in it changed: the genuine ones still open."""
    on_bus = sealed(sealer, flight)
    genuine, passed = np.flatnonzero(is_seal(codec, on_bus)), []
    for n in range(on_bus.size):
        if n in genuine:
            for byte in range(4, 64):
                wrong = on_bus[n : n + 1].copy()
                wrong["data"][0, byte] ^= 1 << (byte % 8)
                before = verifier.n_trials
                assert verifier.feed(wrong, 0).size == 0
                assert verifier.n_trials - before <= 1
        passed.append(verifier.feed(on_bus[n : n + 1], 0))
    assert np.array_equal(np.concatenate(passed), flight)


def test_frames_and_seals_are_paired_by_number(codec, sealer, verifier, flight):
    """Two frames that change places in the sequence: their MACs are right for each other's number only."""
    on_bus = sealed(sealer, flight)
    swapped = on_bus.copy()
    swapped["data"][[0, 1], 2:4] = on_bus["data"][[1, 0], 2:4]
    passed, refused = judged(verifier, swapped)
    assert np.array_equal(passed, flight[2:])
    assert refused.size == 2


class TestRecordings:
    """What was genuine once is refused when it is sent again, whoever was restarted in between."""

    def test_in_the_same_session(self, sealer, verifier, flight):
        on_bus = sealed(sealer, flight)
        judged(verifier, on_bus)
        passed, refused = judged(verifier, on_bus)
        assert passed.size == 0
        assert np.array_equal(refused, flight)

    def test_by_a_receiver_without_state(self, codec, sealer, flight):
        on_bus = sealed(sealer, flight)
        verifier = Verifier(codec, RING)
        acquainted(verifier, sealer, flight)
        assert judged(verifier, on_bus)[0].size == 0

    def test_with_the_recorded_answer_to_an_earlier_challenge(self, codec, sealer, flight):
        first, second = Verifier(codec, RING), Verifier(codec, RING)
        _, recorded = acquainted(first, sealer, flight)
        on_bus = sealed(sealer, flight)
        assert judged(first, on_bus)[0].size == flight.size
        second.feed(on_bus, NOW)
        second.ask(0)
        second.feed(recorded, NOW)
        assert judged(second, on_bus)[0].size == 0

    def test_of_an_earlier_session(self, codec, sealer, verifier, flight, sessions):
        on_bus = sealed(sealer, flight)
        judged(verifier, on_bus)
        again = Sealer(codec, RING, sessions)
        assert np.array_equal(judged(verifier, sealed(again, flight))[0], flight), "a restart needs no challenge"
        assert judged(verifier, on_bus)[0].size == 0


def test_clocks_do_not_matter(codec, sealer, verifier, flight):
    """The receiver's clock is ten years off, and is set back an hour between two frames."""
    late = flight.copy()
    late["t_ns"] += np.uint64(10 * 365 * 86400 * SECOND)
    late["t_ns"][7:] -= np.uint64(3600 * SECOND)
    on_bus = sealed(sealer, late)
    passed = [verifier.feed(on_bus[n : n + 1], 0) for n in range(on_bus.size)]
    passed, refused = parted(np.concatenate(passed))
    assert passed.size + refused.size == flight.size
    assert refused.size <= 5, "those that waited when the clock was set"


def test_counters_go_on_beyond_16_bits(codec, currents, sealer, verifier):
    sender, passed = Sender(), 0
    frames = currents(20)
    for start in (0, 40_000, 65_526, 30_000, 65_530):  # each later than the one before, across two wraps
        sender.skip(int(frames["id"][0]), (start - sender.next_sequence(int(frames["id"][0]))) % 65536)
        sender.protect(frames)
        frames["t_ns"] = NOW + passed * 10**6
        passed += judged(verifier, sealed(sealer, frames))[0].size
    assert passed == 100


def test_a_receiver_that_missed_a_hundred_thousand_frames_goes_on(codec, sealer, verifier, currents):
    sender, frames = Sender(), currents(10)
    frame_id = int(frames["id"][0])
    assert judged(verifier, sealed(sealer, sender.protect(frames)))[0].size == 10
    for _ in range(20):  # 5 010 numbers apart
        sender.skip(frame_id, 5000)
        sealed(sealer, sender.protect(frames))
    assert judged(verifier, sealed(sealer, sender.protect(frames)))[0].size == 10


def test_a_reader_that_was_stopped_for_a_second_refuses_nothing(sealer, verifier, flight):
    """Frames come from its buffer in batches that end between a frame and its seal."""
    on_bus = sealed(sealer, flight)
    out = [verifier.feed(part, NOW + SECOND) for part in np.array_split(on_bus, 7)]
    assert np.array_equal(np.concatenate(out), flight)


def test_what_has_no_seal_in_time_is_refused(verifier, flight):
    assert verifier.feed(flight[:1], 0).size == 0
    assert verifier.feed(fr.empty(0), int(flight["t_ns"][0]) + PATIENCE_NS).size == 0
    (refused,) = verifier.feed(fr.empty(0), int(flight["t_ns"][0]) + PATIENCE_NS + 1)
    assert refused["flags"] & fr.FrameFlag.REFUSED


def test_guessing_takes_longer_than_an_aircraft_lives():
    """A forger who has the whole bus for himself sends 6 300 frames a second, and each is tried once."""
    tries = 1 / frame_time(64, 1e6, 5e6)
    years = 2 ** (8 * MAC_BYTES - 1) / tries / (365.25 * 86400)
    assert years > 1e7


def test_keys_are_changed_without_stopping(codec, sealer, verifier, flight):
    """Receiver accepts both; then the sender changes; then the old one is taken away."""
    new = bytes(range(16, 32))
    assert np.array_equal(judged(verifier, sealed(sealer, flight))[0], flight)
    verifier.keyring = Keyring({None: [KEY, new]})
    assert np.array_equal(judged(verifier, sealed(sealer, flight))[0], flight)
    sealer.rekey(Keyring({None: [new, KEY]}))
    on_bus = sealed(sealer, flight)
    assert np.array_equal(judged(verifier, on_bus)[0], flight)
    verifier.keyring = Keyring({None: [new]})
    assert np.array_equal(judged(verifier, sealed(sealer, flight))[0], flight)
    old = Sealer(codec, RING, sealer._sessions)
    assert judged(verifier, sealed(old, flight))[0].size == 0, "the old key is worth nothing any more"


@pytest.mark.parametrize("of", [Node("Actuator", 5), Node("Monitor", 3)], ids=str)
def test_a_node_s_key_speaks_for_that_node_only(codec, currents, verifier, sessions, monkeypatch, of):
    """Somebody who has got hold of another node's own key seals frames of actuator 3 with it."""
    thief = Keyring({None: [KEY]})
    monkeypatch.setattr(thief, "sealing", lambda node: RING.sealing(of))
    frames = Sender().protect(currents(5))
    before = verifier.n_trials
    assert judged(verifier, sealed(Sealer(codec, thief, sessions), frames))[0].size == 0
    assert verifier.n_trials - before == 1, "the seal was tried, and no frame"


def test_a_node_that_has_lost_its_sessions_is_refused_and_named(codec, sealer, verifier, flight, tmp_path):
    judged(verifier, sealed(sealer, flight))
    (tmp_path / "lost").write_text("5\n")
    again = Sealer(codec, RING, Sessions(tmp_path / "lost"))
    assert judged(verifier, sealed(again, flight))[0].size == 0
    verifier.feed(again.hear(verifier.ask(2 * SECOND), 2 * SECOND), NOW)
    (line,) = verifier.take_events()
    assert line.startswith("actuator 3 begins session 6 after ")
    assert judged(verifier, sealed(again, flight))[0].size == 0


def test_an_answer_to_a_challenge_must_be_the_node_s_own(codec, sealer, flight):
    """Everybody on the bus sees the nonce: one with anything changed in it is not believed, the genuine one is."""
    verifier = Verifier(codec, RING)
    verifier.feed(sealed(sealer, flight), NOW)
    answer = sealer.hear(verifier.ask(0), 0)
    for byte in range(4, 25):  # nonce, session, key, MAC
        wrong = answer.copy()
        wrong["data"][0, byte] ^= 1 << (byte % 8)
        before = verifier.n_trials
        verifier.feed(wrong, NOW)
        assert verifier.n_trials - before <= 1
        assert verifier._known[Node("Actuator", 3)].session < 0
    verifier.feed(answer, NOW)
    assert np.array_equal(judged(verifier, sealed(sealer, flight))[0], flight)


def test_challenges_make_a_node_begin_a_session_once_a_second_at_most(codec, sealer, flight):
    sealed(sealer, flight)
    stranger = Verifier(codec, OTHER)
    stranger.feed(sealed(sealer, flight), NOW)
    challenge = stranger.ask(0)
    answers = [sealer.hear(challenge, n * SECOND // 100).size for n in range(301)]
    assert sum(answers) == 4


def test_fault_injection_is_sealed_as_well(codec, sealer):
    control = Sender().protect(codec.encode("SimulatorControl", 0, {"k": np.zeros(6), "ramp_time": 0.0}, NOW))
    verifier = Verifier(codec, RING, "Actuator")
    acquainted(verifier, sealer, control)
    passed, refused = judged(verifier, control)
    assert passed.size == 0
    assert np.array_equal(refused, control)
    assert np.array_equal(judged(verifier, sealed(sealer, control))[0], control)


def test_frames_of_nobody_pass(codec):
    foreign = fr.empty(1)
    foreign["id"], foreign["t_ns"] = 0x123, NOW
    assert np.array_equal(Verifier(codec, RING).feed(foreign, NOW), foreign)


@pytest.fixture
def key_file(tmp_path):
    path = tmp_path / "key"
    path.write_text(KEY.hex() + "\n")
    path.chmod(0o600)
    return path


def read_for(port, seconds, until=None):
    """Frames that come within some seconds; until a number of them is there."""
    found, end = [fr.empty(0)], time.monotonic() + seconds
    while time.monotonic() < end and (until is None or sum(map(len, found)) < until):
        found.append(port.read(0.02))
    return np.concatenate(found)


def test_on_a_bus_with_and_without_a_key(codec, currents, key_file, tmp_path):
    place = parse("virtual:authenticated")
    locked = place.model_copy(update={"key_file": key_file})
    frames, out = currents(20), Sender()
    with open_bus(place) as stranger, open_bus(locked) as sender, open_bus(locked) as receiver:
        assert receiver.choice.endswith("frames are authenticated")
        sender.write(out.protect(frames))
        assert (parted(read_for(receiver, 5, until=20))[0]).size == 0, "not known yet: asks"
        read_for(sender, 0.3)  # is asked, and answers
        read_for(receiver, 0.05)
        again = out.protect(frames.copy())
        sender.write(again)
        assert np.array_equal(parted(read_for(receiver, 5, until=20))[0]["data"], again["data"])
        assert stranger.read(1.0).size > 0
        stranger.write(Sender().protect(currents(10, seed=9)))
        refused = read_for(receiver, 5, until=10)
        assert (Receiver(codec).check(refused) == Check.REFUSED).all()
        assert refused.size == 10


def test_keys_are_read_again_when_their_file_changes(codec, currents, key_file, monkeypatch):
    monkeypatch.setattr("ema.bus.authenticated._LOOK_NS", 0)
    with open_bus(parse("virtual:rekeyed").model_copy(update={"key_file": key_file})) as port:
        key_file.write_text("no key")
        port.read(0.0)
        (line,) = port.take_events()
        assert line.endswith("the keys of before stay")
        key_file.write_text(f"{bytes(16).hex()}\n{KEY.hex()}\n")
        port.read(0.0)
        assert port.take_events() == [f"key file {key_file}: keys are changed"]


def test_aes_cmac_literature():
    """RFC 4493, section 4, example 3 (40 bytes): the library's CMAC, truncated, is what a seal carries."""
    node = Node("Actuator", 0)
    key = Keyring({node: [bytes.fromhex("2b7e151628aed2a6abf7158809cf4f3c")]}).sealing(node)
    message = bytes.fromhex("6bc1bee22e409f96e93d7e117393172aae2d8a571e03ac9c9eb76fac45af8e5130c81c46a35ce411")
    assert key.mac(message).hex() == "dfa66747de9ae630"


@settings(deadline=None)
@given(st.data())
def test_arbitrary_frames_never_break_the_verifier(codec, any_frames, data):
    verifier = Verifier(codec, RING)
    for now_ns in (0, 10**9, 2**63):
        frames = data.draw(any_frames)
        before = verifier.n_trials
        verifier.feed(frames, now_ns)
        assert verifier.n_trials - before <= frames.size
        verifier.ask(now_ns)
        assert sum(map(len, verifier._by_place.values())) == len(verifier._waiting)
