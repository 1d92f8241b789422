"""The kernel's own CAN, before any code of the project: what the other tests of this folder stand on."""

import socket
import struct

import pytest

SO_RXQ_OVFL = 40  # asm-generic/socket.h; Python does not name it


def test_fd_frame_between_two_sockets_with_candump_as_witness(raw_can, candump):
    payload = bytes(range(64))
    sender, receiver, dump = raw_can(), raw_can(), candump(1)
    sender.send_frame(0x1ABCDEF0 | sender.EXTENDED, payload)
    assert receiver.receive_frame() == (0x1ABCDEF0 | sender.EXTENDED, payload)
    (line,) = dump()
    _time, interface, frame = line.split()
    identifier, _, flags_and_data = frame.partition("##")
    assert (interface, identifier) == ("vcan0", "1ABCDEF0")
    assert bytes.fromhex(flags_and_data[1:]) == payload


def test_mtu_of_classic_can_refuses_fd_frames(raw_can, link):
    link.set_mtu(16)
    try:
        with pytest.raises(OSError, match="Invalid argument"):
            raw_can().send_frame(0x123, bytes(64))
    finally:
        link.set_mtu(72)


def test_full_transmit_queue_refuses_frames(raw_can, link):
    sender = raw_can()
    link.throttle()
    with pytest.raises(OSError, match="No buffer space"):
        _send_many(sender)
    link.release()
    sender.send_frame(0x123, bytes(64))


def test_kernel_counts_what_a_full_receive_buffer_drops(raw_can):
    sender, receiver = raw_can(), raw_can()
    receiver.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1)  # the kernel rounds up to its least
    n_sent = 200
    for number in range(n_sent):
        sender.send_frame(number, bytes(64))
    receiver.recv(72)  # a kernel under load delivers late
    receiver.setblocking(False)
    n_received = 1
    while _readable(receiver):
        n_received += 1
    receiver.settimeout(10)
    sender.send_frame(0, bytes(64))  # the count comes with the next frame
    _data, control, _flags, _address = receiver.recvmsg(72, 128)
    drops = [struct.unpack("=I", data)[0] for level, kind, data in control if kind == SO_RXQ_OVFL]
    assert 0 < n_received < n_sent
    assert drops == [n_sent - n_received]


def _send_many(sender):
    for _ in range(100):
        sender.send_frame(0x123, bytes(64))


def _readable(can):
    try:
        return can.recv(72)
    except BlockingIOError:
        return None
