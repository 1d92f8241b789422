import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ema.bus.authentication import Sealer, Verifier, load_key
from ema.bus.codec import default
from ema.bus.header import sequence
from ema.bus.interface import open_bus, parse
from ema.bus.protection import Check, Receiver, Sender
from ema.core import frames as fr
from ema.core.errors import BusError

KEY = bytes(range(16))
NOW = 1_790_000_000 * 10**9


@pytest.fixture
def flight(codec, currents):
    """25 frames of currents, then the end of the cycle, one to a millisecond; and what goes over the bus."""
    values = dict.fromkeys(codec.messages["CycleEnd"].fields, 0)
    frames = np.concatenate([currents(25), codec.encode("CycleEnd", 3, values)])
    frames["t_ns"] = NOW + np.arange(frames.size) * 10**6
    return Sender().protect(frames)


def sealed(codec, frames, key=KEY):
    """The frames in their order, with the seals between them."""
    sealer, out = Sealer(codec, key), []
    for n in range(frames.size):
        t_ns = int(frames["t_ns"][n])
        seals = sealer.add(frames[n : n + 1], t_ns)
        seals["t_ns"] = t_ns
        out += [frames[n : n + 1], seals]
    return np.concatenate(out)


def judged(codec, frames, key=KEY, patience=10**9):
    """What passes a receiver, frame by frame, and what it refuses."""
    verifier = Verifier(codec, key)
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


def test_genuine_frames_pass_in_their_order_and_seals_are_taken_out(codec, flight):
    on_bus = sealed(codec, flight)
    assert on_bus.size == flight.size + 4  # 10 + 10 + 5 currents, 1 end
    passed, refused = judged(codec, on_bus, patience=0)
    assert np.array_equal(passed, flight)
    assert refused.size == 0


def test_the_end_of_a_cycle_does_not_wait(codec, flight):
    verifier = Verifier(codec, KEY)
    on_bus = sealed(codec, flight)
    assert verifier.feed(on_bus, int(on_bus["t_ns"][-1])).size == flight.size


def test_another_key_passes_nothing(codec, flight):
    passed, refused = judged(codec, sealed(codec, flight), key=bytes(16))
    assert passed.size == 0
    assert np.array_equal(refused, flight)


def test_a_frame_changed_with_a_correct_crc_is_refused_alone(codec, flight):
    on_bus = sealed(codec, flight)
    other = forged(on_bus[4:5])
    passed, refused = judged(codec, np.concatenate([on_bus[:4], other, on_bus[4:]]))
    assert np.array_equal(passed, flight)
    assert np.array_equal(refused, other)


def test_the_receiver_counts_a_forged_frame_as_refused_and_a_damaged_one_as_damaged(codec, flight):
    """Neither moves the sequence: nothing is lost by it."""
    on_bus = sealed(codec, flight)
    damaged = on_bus[4:5].copy()
    damaged["data"][0, 20] ^= 1
    frames = np.concatenate([on_bus[:4], forged(on_bus[4:5]), damaged, on_bus[4:]])
    verifier, receiver = Verifier(codec, KEY), Receiver(codec)
    checks = receiver.check(verifier.feed(frames, NOW + 10**9))
    assert np.count_nonzero(checks == Check.REFUSED) == 1
    counts = receiver.counts
    assert (counts.n_refused, counts.n_crc_error, counts.n_lost, counts.n_good) == (1, 1, 0, flight.size)


def test_a_recording_played_again_is_refused(codec, flight):
    on_bus = sealed(codec, flight)
    soon = on_bus.copy()
    soon["t_ns"] += 100 * 10**6
    passed, refused = judged(codec, np.concatenate([on_bus, soon]))
    assert np.array_equal(passed, flight)
    assert refused.size == flight.size
    later = on_bus.copy()
    later["t_ns"] += 3600 * 10**9
    assert judged(codec, later)[0].size == 0, "also by a receiver that was started in between"


def test_a_lost_frame_costs_no_other_and_a_lost_seal_its_ten(codec, flight):
    on_bus = sealed(codec, flight)
    passed, _ = judged(codec, np.delete(on_bus, 3))
    assert np.array_equal(passed, np.delete(flight, 3))
    passed, refused = judged(codec, np.delete(on_bus, 10))
    assert np.array_equal(passed, flight[10:])
    assert np.array_equal(refused, flight[:10])


def test_a_forged_seal_does_not_shut_the_door(codec, flight):
    """Freshness far ahead, but no MAC that fits: the next genuine seal still opens."""
    other = Sealer(codec, bytes(16)).add(flight[:10], NOW + 10**9)
    other["t_ns"] = NOW
    passed, _ = judged(codec, np.concatenate([other, sealed(codec, flight)]))
    assert np.array_equal(passed, flight)


@pytest.mark.parametrize("ahead", [0, 10, 5000], ids=["same numbers", "next ones", "far ahead"])
def test_a_flood_of_forged_frames_delays_nothing(codec, flight, ahead):
    """Twenty forged ones before each frame: a genuine one is through as soon as its seal is there, and in order."""
    on_bus, verifier, passed = sealed(codec, flight), Verifier(codec, KEY), []
    for n in range(on_bus.size):
        flood = np.repeat(flight[n % flight.size : n % flight.size + 1], 20)
        Sender().protect(flood)
        flood["t_ns"] = on_bus["t_ns"][n]
        flood["data"][:, 2] += np.uint8(ahead % 256)
        flood["data"][:, 3] += np.uint8(ahead // 256)
        flood["data"][:, 20] ^= 1 + np.arange(20, dtype=np.uint8)
        passed.append(parted(verifier.feed(np.concatenate([flood, on_bus[n : n + 1]]), 0))[0])
        is_seal = codec.find(int(on_bus["id"][n])).name == "ActuatorSeal"
        assert passed[-1].size == 0 or is_seal
    assert np.array_equal(np.concatenate(passed), flight)


def test_a_reader_that_was_stopped_for_a_second_refuses_nothing(codec, flight):
    """Frames come from its buffer in batches that end between a frame and its seal."""
    on_bus, verifier = sealed(codec, flight), Verifier(codec, KEY)
    out = [verifier.feed(part, NOW + 10**9) for part in np.array_split(on_bus, 7)]
    assert np.array_equal(np.concatenate(out), flight)


def test_fault_injection_is_sealed_as_well(codec):
    control = Sender().protect(codec.encode("SimulatorControl", 0, {"k": np.zeros(6), "ramp_time": 0.0}, NOW))
    passed, refused = judged(codec, control)
    assert passed.size == 0
    assert np.array_equal(refused, control)
    passed, refused = judged(codec, sealed(codec, control))
    assert np.array_equal(passed, control)


def test_frames_of_nobody_pass(codec):
    foreign = fr.empty(1)
    foreign["id"], foreign["t_ns"] = 0x123, NOW
    assert np.array_equal(Verifier(codec, KEY).feed(foreign, NOW), foreign)


@pytest.fixture
def key_file(tmp_path):
    path = tmp_path / "key"
    path.write_text(KEY.hex() + "\n")
    path.chmod(0o600)
    return path


def test_on_a_bus_with_and_without_a_key(codec, currents, key_file):
    place = parse("virtual:authenticated")
    locked = place.model_copy(update={"key_file": key_file})
    frames = Sender().protect(currents(10))
    with open_bus(place) as stranger, open_bus(locked) as sender, open_bus(locked) as receiver:
        assert receiver.choice.endswith("frames are authenticated")
        assert sender.write(frames) == 10
        assert np.array_equal(receiver.read(1.0)["data"], frames["data"])
        assert stranger.read(1.0).size == 11
        stranger.write(Sender().protect(currents(10, seed=9)))
        refused = np.concatenate([receiver.read(0.1) for _ in range(3)])
        assert (Receiver(codec).check(refused) == Check.REFUSED).all()
        assert refused.size == 10


@pytest.mark.parametrize(
    ("text", "mode", "said"),
    [
        (KEY.hex(), 0o644, "others can read it: chmod 600"),
        ("abc", 0o600, "32, 48 or 64 hexadecimal digits"),
        ("x" * 32, 0o600, "hexadecimal digits"),
        ("é" * 32, 0o600, "cannot be read"),
        (None, 0, "cannot be read"),
    ],
)
def test_a_bad_key_file_is_refused(tmp_path, text, mode, said):
    path = tmp_path / "key"
    if text is not None:
        path.write_text(text)
        path.chmod(mode)
    with pytest.raises(BusError, match=said):
        load_key(path)


def test_aes_cmac_literature():
    """RFC 4493, section 4, example 3 (40 bytes): the library's CMAC, truncated, is what a seal carries."""
    key = bytes.fromhex("2b7e151628aed2a6abf7158809cf4f3c")
    message = bytes.fromhex("6bc1bee22e409f96e93d7e117393172aae2d8a571e03ac9c9eb76fac45af8e5130c81c46a35ce411")
    verifier = Verifier(default(), key)
    data_id, freshness = int.from_bytes(message[:2], "big"), int.from_bytes(message[2:10], "big")
    assert verifier.mac(data_id, freshness, message[10:]) == 0xDFA66747


@settings(deadline=None)
@given(st.data())
def test_arbitrary_frames_never_break_the_verifier(codec, any_frames, data):
    verifier = Verifier(codec, KEY)
    for now_ns in (0, 10**9, 2**63):
        verifier.feed(data.draw(any_frames), now_ns)
        assert sum(map(len, verifier._by_number.values())) == len(verifier._waiting)
