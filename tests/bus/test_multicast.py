import socket

import can
import msgpack
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

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
