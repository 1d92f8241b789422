"""The bus port on the kernel's CAN: what the link and the queue do to it, and that it goes on by itself."""

import time

import numpy as np
import pytest

from ema.bus.interface import open_bus, parse
from ema.bus.socketcan import SocketCanPort
from ema.core import frames as fr

CAN_ID = 0x0A321C00
PATIENCE = 20  # [s]


@pytest.fixture
def port(vcan0):
    with open_bus(parse(vcan0)) as port:
        yield port


def receive(port, n_frames, patience=PATIENCE):
    """Frames from the port until `n_frames` are there or patience ends."""
    batches, end = [fr.empty(0)], time.monotonic() + patience
    while sum(map(len, batches)) < n_frames and time.monotonic() < end:
        batches.append(port.read(0.1))
    return np.concatenate(batches)


def send(can, numbers):
    for number in numbers:
        can.send_frame(CAN_ID | can.EXTENDED, bytes([number]) + bytes(63))


def numbers(frames):
    return frames["data"][:, 0].tolist()


def some_frames(count):
    frames = fr.empty(count)
    frames["id"], frames["flags"], frames["length"] = CAN_ID, fr.FrameFlag.EXTENDED | fr.FrameFlag.FD, 64
    frames["data"][:, 0] = np.arange(count)
    return frames


def test_frames_arrive_whole_with_the_kernels_time(port, raw_can):
    before = time.time_ns()
    send(raw_can(), range(100))
    frames = receive(port, 100)
    assert numbers(frames) == list(range(100))
    assert set(frames["id"].tolist()) == {CAN_ID}
    assert set(frames["length"].tolist()) == {64}
    assert np.all(frames["flags"] & (fr.FrameFlag.EXTENDED | fr.FrameFlag.FD))
    t_ns = frames["t_ns"].astype(np.int64)
    assert before <= t_ns[0] <= t_ns[-1] <= time.time_ns()
    assert np.all(np.diff(t_ns) >= 0)


def test_sent_frames_reach_another_socket(port, raw_can):
    witness = raw_can()
    assert port.write(some_frames(20)) == 20
    assert [witness.receive_frame()[1][0] for _ in range(20)] == list(range(20))


def test_link_down_and_up(port, raw_can, link):
    send(raw_can(), range(5))
    link.down()
    assert numbers(receive(port, 5)) == [0, 1, 2, 3, 4]  # what had arrived is not lost
    assert len(receive(port, 1, patience=0.5)) == 0
    assert any("down" in event for event in port.take_events())
    assert port.counters.n_link_down == 1
    link.up()
    send(raw_can(), range(5, 10))
    assert numbers(receive(port, 5)) == [5, 6, 7, 8, 9]


def test_sending_while_the_link_is_down(port, raw_can, link):
    link.down()
    assert port.write(some_frames(3)) == 0
    link.up()
    witness = raw_can()
    assert port.write(some_frames(3)) == 3
    assert witness.receive_frame()[1][0] == 0


def test_interface_deleted_and_made_again(port, raw_can, link):
    send(raw_can(), range(5))
    link.delete()
    assert numbers(receive(port, 5)) == [0, 1, 2, 3, 4]
    assert len(receive(port, 1, patience=0.5)) == 0
    assert port.take_events()
    link.create()
    wait_for_reopening(port, raw_can)
    witness = raw_can()
    assert port.write(some_frames(1)) == 1
    assert witness.receive_frame()[1][0] == 0


def test_interface_deleted_and_made_again_between_two_reads(port, raw_can, link):
    assert len(port.read(0)) == 0
    link.delete()
    link.create()
    wait_for_reopening(port, raw_can)


def wait_for_reopening(port, raw_can):
    sender, end = raw_can(), time.monotonic() + PATIENCE
    while time.monotonic() < end:
        send(sender, [7])
        if len(port.read(0.2)):
            return
    pytest.fail("the port has not found the new interface")


def test_full_transmit_queue_is_survived(port, raw_can, link):
    link.throttle()
    n_taken = port.write(some_frames(50))
    assert n_taken < 50
    assert port.counters.n_send_retries + port.counters.n_send_failed > 0
    assert port.take_events()
    link.release()
    witness = raw_can()
    assert port.write(some_frames(3)) == 3
    assert [witness.receive_frame()[1][0] for _ in range(3)] == [0, 1, 2]


def test_error_frames_are_counted_and_said(port, raw_can):
    bus_off = 0x40  # linux/can/error.h
    raw_can().send_error(bus_off)
    send(raw_can(), [1])
    frames = receive(port, 1)
    assert numbers(frames[(frames["flags"] & fr.FrameFlag.ERROR) == 0]) == [1]
    assert port.counters.n_error_frames == 1
    assert any("bus-off" in event for event in port.take_events())


def test_classic_and_remote_frames_do_no_harm(port, raw_can):
    can = raw_can()
    can.send_classic(0x123, b"\x01\x02")
    can.send_classic(0x123 | 0x40000000, b"")  # remote request
    send(can, [9])
    frames = receive(port, 3, patience=2)
    assert numbers(frames[frames["id"] == CAN_ID]) == [9]


def test_interface_set_to_classic_can_is_said_with_the_remedy(vcan0, link):
    link.set_mtu(16)
    try:
        with SocketCanPort(vcan0) as port:
            assert any("mtu 72" in event for event in port.take_events())
            assert port.write(some_frames(1)) == 0
            assert any("cannot send" in event for event in port.take_events())
    finally:
        link.set_mtu(72)


def test_receive_buffer_that_is_too_small_is_said_with_the_remedy(vcan0):
    with SocketCanPort(vcan0, receive_buffer=1 << 30) as port:
        (event,) = port.take_events()
    assert "net.core.rmem_max" in event


def test_frames_the_kernel_had_to_drop_are_counted(vcan0, raw_can):
    n_sent = 500
    with SocketCanPort(vcan0, receive_buffer=1) as port:  # the kernel rounds up to its least
        sender = raw_can()
        send(sender, np.arange(n_sent) % 256)
        n_received = len(receive(port, n_sent, patience=1))
        send(sender, [0])  # the count comes with the next frame
        assert len(receive(port, 1)) == 1
        assert 0 < port.counters.kernel_drops == n_sent - n_received


def test_filters_leave_out_the_rest(vcan0, raw_can, link):
    same_but_for_actuator = 0x1FFFFFFF & ~0xFC
    with SocketCanPort(vcan0, filters=[(CAN_ID, same_but_for_actuator)]) as port:
        for _ in range(2):  # also after the interface, and the kernel's list of filters, are new
            can = raw_can()
            can.send_frame(CAN_ID | 5 << 2 | can.EXTENDED, bytes(64))
            can.send_frame(CAN_ID + 0x100 | can.EXTENDED, bytes(64))
            can.send_classic(CAN_ID & 0x7FF, bytes(8))
            assert receive(port, 3, patience=1)["id"].tolist() == [CAN_ID | 5 << 2]
            link.delete()
            link.create()
            receive(port, 1, patience=0.5)


def test_nothing_is_left_beyond_the_length(port, raw_can):
    can = raw_can()
    can.send_frame(CAN_ID | can.EXTENDED, b"\xff" * 64)
    can.send(can.FRAME.pack(CAN_ID | can.EXTENDED, 12, 0, b"\xee" * 64))  # the sender leaves its own rest behind
    can.send_classic(CAN_ID | can.EXTENDED, b"\x01\x02")
    frames = receive(port, 3)
    assert frames["length"].tolist() == [64, 12, 2]
    assert frames["data"].sum(axis=1).tolist() == [64 * 0xFF, 12 * 0xEE, 3]
