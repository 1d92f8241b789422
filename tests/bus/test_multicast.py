import socket
import subprocess
import sys
from contextlib import ExitStack

import can
import msgpack
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ema.bus.flood import MOST_FRAMES, Flood
from ema.bus.multicast import MulticastPort
from ema.core import frames as fr
from ema.core.can_messages import message
from ema.core.frames import FrameFlag

GROUP, PORT = "239.74.163.77", 43777


def opened():
    return MulticastPort(GROUP, port=PORT)


def throw(payload: bytes):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as thrower:
        thrower.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        thrower.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        thrower.sendto(payload, (GROUP, PORT))


def any_frame(length: int, flags: FrameFlag):
    frame = fr.empty(1)
    frame["id"], frame["flags"], frame["length"] = 0x123, int(flags), length
    frame["data"][0, :length] = np.arange(length) + 1
    return frame


def test_a_port_does_not_hear_itself(currents):
    with opened() as port, opened() as other:
        port.write(currents(3))
        assert other.read(1.0).size == 3
        assert port.read(0.05).size == 0


@pytest.mark.parametrize(
    "frame",
    [any_frame(8, FrameFlag(0)), any_frame(0, FrameFlag.EXTENDED), any_frame(64, FrameFlag.FD | FrameFlag.BRS)],
)
def test_python_can_speaks_the_same(frame):
    try:
        peer = can.Bus(interface="udp_multicast", channel=GROUP, port=PORT, hop_limit=0)
    except can.CanError:
        pytest.skip("python-can's own bus needs a default route")
    with peer, opened() as port:
        port.write(frame)
        heard = peer.recv(1.0)
        assert heard.equals(message(frame[0]), timestamp_delta=None, check_channel=False)
        peer.send(message(frame[0]))
        (back,) = port.read(1.0)
        for name in ("id", "flags", "length", "data"):
            assert np.array_equal(back[name], frame[0][name])
        assert back["t_ns"] > 1_600_000_000 * 10**9


PACKED = {
    "timestamp": 0.0,
    "arbitration_id": 1,
    "is_extended_id": True,
    "is_remote_frame": False,
    "is_error_frame": False,
    "is_fd": True,
    "bitrate_switch": False,
    "error_state_indicator": False,
    "channel": None,
    "dlc": 2,
    "data": b"ab",
}
ODD = st.one_of(st.none(), st.booleans(), st.integers(-(2**63), 2**64 - 1), st.binary(max_size=80), st.text(max_size=5))


@pytest.fixture(scope="module")
def port():
    with opened() as port:
        yield port


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    st.one_of(
        st.binary(max_size=300),
        ODD.map(msgpack.packb),
        st.dictionaries(st.sampled_from(sorted(PACKED)), ODD).map(lambda changed: msgpack.packb({**PACKED, **changed})),
    )
)
def test_whatever_is_thrown_at_the_group_is_counted_or_a_frame(port, payload):
    before = port.counters.n_received + port.counters.n_unreadable + port.counters.n_error_frames
    throw(payload)
    port.read(0.01)
    counters = port.counters
    assert counters.n_received + counters.n_unreadable + counters.n_error_frames == before + 1


def test_a_full_buffer_is_counted(currents):
    with MulticastPort(GROUP, port=PORT, receive_buffer=1 << 12) as slow, opened() as sender:
        n_sent = 0
        for _ in range(20):
            n_sent += sender.write(currents(50))
        n_read = 0
        while (batch := slow.read(0.05)).size:
            n_read += batch.size
        assert n_read < n_sent
        sender.write(currents(1))
        n_read += slow.read(1.0).size
        assert slow.counters.kernel_drops == n_sent + 1 - n_read


FLOOD = """
import socket, sys, time
import msgpack
group, port, kind, seconds = sys.argv[1], int(sys.argv[2]), sys.argv[3], float(sys.argv[4])
frame = {"timestamp": 0.0, "arbitration_id": 0x155, "is_extended_id": True, "is_remote_frame": False,
         "is_error_frame": kind == "error", "is_fd": True, "bitrate_switch": True, "error_state_indicator": False,
         "channel": None, "dlc": 8, "data": bytes(8)}
payload = b"junk" * 8 if kind == "junk" else msgpack.packb(frame)
thrower = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
thrower.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
thrower.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
thrower.connect((group, port))
end, count = time.monotonic() + seconds, 0
print("begun", flush=True)
while time.monotonic() < end:
    for _ in range(100):
        thrower.send(payload)
    count += 100
print(count)
"""


@pytest.mark.parametrize("kind", ["junk", "foreign", "error"])
def test_a_flood_of_others_neither_keeps_the_port_nor_hides_it(currents, codec, kind):
    """Reads end whatever is sent, what is wanted is still found, and the flood is told."""
    filters = codec.filters("Actuator")
    command = [sys.executable, "-c", FLOOD, GROUP, str(PORT), kind, "3"]
    with ExitStack() as stack, MulticastPort(GROUP, filters, PORT) as port, opened() as actuator:
        thrower = stack.enter_context(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
        assert thrower.stdout.readline() == "begun\n"
        n_found = n_sent = 0
        flooded = False
        while thrower.poll() is None:
            n_sent += actuator.write(currents(10))
            n_found += port.read(0.05).size
            flooded |= port.flooded
        while part := port.read(0.1).size:
            n_found += part
            flooded |= port.flooded
        n_sent += actuator.write(currents(10))  # the kernel tells with the next datagram what it dropped before
        while part := port.read(0.1).size:
            n_found += part
        n_thrown = int(thrower.stdout.read())
    print(f"{n_thrown} of others in 3 s, {n_sent} wanted, {n_found} found, {port.counters.kernel_drops} dropped")
    assert flooded or n_thrown / 3 < 1.5 * MOST_FRAMES  # a busy machine may not throw as fast
    assert not flooded or n_thrown / 3 > 0.5 * MOST_FRAMES
    assert n_found > 0
    assert n_found >= n_sent - port.counters.kernel_drops


def test_a_flood_is_more_than_a_bus_carries_and_ends():
    flood = Flood()
    for second in range(3):
        flood.note(round(0.9 * MOST_FRAMES), 0, 100.0 + second)
    assert not flood.flooded
    flood.note(round(1.1 * MOST_FRAMES), 0, 103.0)
    assert flood.flooded
    flood.note(10, 0, 104.0)
    assert not flood.flooded
    flood.note(round(0.6 * MOST_FRAMES), round(0.6 * MOST_FRAMES), 105.0)  # and as many were dropped
    assert flood.flooded
    flood.note(0, round(2 * MOST_FRAMES), 106.0)  # dropped, but none is foreign
    assert not flood.flooded
