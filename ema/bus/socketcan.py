"""The Linux kernel's CAN as a port: a raw socket that survives what happens to its interface."""

from __future__ import annotations

import errno
import fcntl
import select
import socket
import struct
import time

import numpy as np

from ema.core import frames as fr
from ema.core.errors import BusError
from ema.core.frames import FrameFlag
from ema.core.status import BusState

from . import mmsg
from .port import RECEIVE_BUFFER, Filters, Port, ask_for_buffer

_CAN_RAW_ERR_FILTER = 2  # linux/can/raw.h; Python's socket module does not name it
_SIOCGIFMTU = 0x8921  # linux/sockios.h
_ERROR = np.uint8(FrameFlag.ERROR)
_ALL_ERRORS = 0x1FFFFFFF
_FULL_QUEUE_PATIENCE = 0.05  # [s]
_FULL_QUEUE_PAUSE = 0.001  # [s]
UP, DOWN, GONE = "link up again", "link down", "interface deleted"
_GONE_PAUSE = 0.05  # between two looks for an interface that is not there [s]

# linux/can/error.h
_ERROR_CLASSES = {
    0x001: "transmission timed out",
    0x002: "arbitration lost",
    0x004: "controller problem",
    0x008: "protocol violation",
    0x010: "transceiver",
    0x020: "no acknowledgement",
    0x040: "bus-off",
    0x080: "bus error",
    0x100: "controller restarted",
}
_PROBLEM, _BUS_OFF, _RESTARTED = 0x004, 0x040, 0x100
_WARNING, _PASSIVE, _ACTIVE = 0x0C, 0x30, 0x40  # of the second byte, for reception and transmission


class SocketCanPort(Port):
    """A raw CAN FD socket on an interface.

    Parameters
    ----------
    interface : str
        vcan0, can0 …
    filters : Filters, optional
        Extended identifiers to receive. The kernel leaves out the rest before it costs anything. Default: everything.
    receive_buffer : int
        Asked of the kernel; when it grants less, an event says so and what to do. [B]

    Raises
    ------
    BusError
        No such interface, or no CAN in this kernel.
    """

    def __init__(self, interface: str, filters: Filters | None = None, receive_buffer: int = RECEIVE_BUFFER):
        super().__init__(f"socketcan:{interface}")
        self._interface = interface
        self._in, self._out = mmsg.Batch(), mmsg.Batch()
        self._filters = _packed(filters)
        self._index = 0  # of the interface the socket is bound to, 0: none
        self._link_state = UP
        self._send_trouble = ""
        self._errors_said = 0
        self._controller = BusState.ACTIVE
        try:
            self._socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW | socket.SOCK_NONBLOCK, socket.CAN_RAW)
        except (OSError, AttributeError) as error:
            raise BusError(f"bus {self.name} cannot be opened (no CAN in this kernel)") from error
        try:
            self._configure(receive_buffer)
            self._bind()
        except OSError as error:
            self._socket.close()
            raise BusError(f"bus {self.name} cannot be opened ({error.strerror})") from error
        self._poll = select.poll()
        self._poll.register(self._socket, select.POLLIN | select.POLLERR)

    def read(self, timeout: float) -> np.ndarray:
        """See Port."""
        end = time.monotonic() + timeout
        while True:
            batch = self._receive()
            if len(batch):
                return batch
            left = end - time.monotonic()
            if not self._is_bound():
                left = min(left, _GONE_PAUSE)
                if left > 0:
                    time.sleep(left)
            elif left > 0:
                self._poll.poll(left * 1000)
            if left <= 0:
                return batch

    def write(self, frames: np.ndarray) -> int:
        """See Port."""
        n_sent, end = 0, time.monotonic() + _FULL_QUEUE_PATIENCE
        while n_sent < len(frames):
            try:
                n_sent += self._out.send(self._socket.fileno(), frames[n_sent:])
            except OSError as error:
                if error.errno == errno.EINTR or self._is_old_news(error):
                    continue
                if error.errno in (errno.ENOBUFS, errno.EAGAIN) and time.monotonic() < end:
                    self.counters.n_send_retries += 1
                    time.sleep(_FULL_QUEUE_PAUSE)
                    continue
                self.counters.n_send_failed += len(frames) - n_sent
                self._say_send_trouble(str(error.strerror))
                break
        else:
            self._say_send_trouble("")
            self._set_link(UP)
        self.counters.n_sent += n_sent
        return n_sent

    def close(self) -> None:
        """See Port."""
        self._socket.close()

    def _configure(self, receive_buffer: int) -> None:
        sock = self._socket
        sock.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
        sock.setsockopt(socket.SOL_CAN_RAW, _CAN_RAW_ERR_FILTER, _ALL_ERRORS)
        sock.setsockopt(socket.SOL_SOCKET, mmsg.SO_TIMESTAMPNS, 1)
        sock.setsockopt(socket.SOL_SOCKET, mmsg.SO_RXQ_OVFL, 1)
        if warning := ask_for_buffer(sock, receive_buffer):
            self._events.append(f"{self.name}: {warning}")

    def _bind(self) -> None:
        # Each time: a deleted interface takes the socket's filters with it, and then nothing is received at all.
        self._socket.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, self._filters)
        self._socket.bind((self._interface,))
        self._index = socket.if_nametoindex(self._interface)
        request = struct.pack("16si12x", self._interface.encode(), 0)  # struct ifreq
        (mtu,) = struct.unpack_from("16xi", fcntl.ioctl(self._socket, _SIOCGIFMTU, request))
        if mtu < mmsg.FD_SIZE:
            self._events.append(f"{self.name}: MTU {mtu} is classic CAN: ip link set {self._interface} mtu 72")

    def _receive(self) -> np.ndarray:
        """Frames that wait; deals with the link's troubles."""
        try:
            received = self._in.receive(self._socket.fileno())
        except OSError as error:
            self._link_trouble(error)
            return fr.empty(0)
        if received.n_dropped:
            self.counters.kernel_drops = received.n_dropped
        whole = (received.size == mmsg.CLASSIC_SIZE) | (received.size == mmsg.FD_SIZE)
        if not whole.all():
            self.counters.n_unreadable += int(np.count_nonzero(~whole))
            received = received.where(whole)
        frames = mmsg.from_kernel(received)
        if not frames["t_ns"].all():
            frames["t_ns"][frames["t_ns"] == 0] = time.time_ns()
        frames = self._without_errors(frames)
        if len(frames):
            self.counters.n_received += len(frames)
            self._set_link(UP)
        return frames

    def _without_errors(self, frames: np.ndarray) -> np.ndarray:
        if not np.bitwise_or.reduce(frames["flags"]) & _ERROR:
            return frames
        is_error = (frames["flags"] & _ERROR) != 0
        self.counters.n_error_frames += int(np.count_nonzero(is_error))
        for frame in frames[is_error]:
            self._controller = _controller(int(frame["id"]), int(frame["data"][1]), self._controller)
        self._tell_state()
        classes = int(np.bitwise_or.reduce(frames["id"][is_error]))
        if classes != self._errors_said:  # a bus in trouble sends thousands of the same
            self._errors_said = classes
            names = [text for bit, text in _ERROR_CLASSES.items() if classes & bit]
            self._events.append(f"{self.name}: error frames: {', '.join(names) or hex(classes)}")
        return frames[~is_error]

    def _is_old_news(self, error: OSError) -> bool:
        """Whether a failed sending only told, before anything was tried, what had happened to the link meanwhile."""
        before = self._link_state
        if error.errno in (errno.ENETDOWN, errno.ENODEV):
            self._link_trouble(error)
        return self._link_state != before

    def _link_trouble(self, error: OSError) -> None:
        if error.errno in (errno.EAGAIN, errno.EINTR):
            return
        if error.errno == errno.ENETDOWN:
            self._set_link(DOWN)
        elif error.errno == errno.ENODEV:
            self._index = 0
            self._set_link(GONE)
        else:
            self.counters.n_unreadable += 1
            self._events.append(f"{self.name}: {error.strerror}")

    def _set_link(self, state: str) -> None:
        if state != self._link_state:
            self.counters.n_link_down += self._link_state == UP
            self._link_state = state
            self._tell_state()
            self._events.append(f"{self.name}: {state}")

    def _tell_state(self) -> None:
        self._bus_state = self._controller if self._link_state == UP else BusState.DOWN

    def _is_bound(self) -> bool:
        """Whether the socket is bound to the interface of this name; binds it again when that is a new one.

        The socket itself is kept, and with it what it had received before.
        """
        try:
            index = socket.if_nametoindex(self._interface)
            if index != self._index:
                self._bind()
                self._events.append(f"{self.name}: interface is there again")
        except OSError:
            self._index = 0
            return False
        return True

    def _say_send_trouble(self, text: str) -> None:
        if text and text != self._send_trouble:
            self._events.append(f"{self.name}: cannot send: {text}")
        self._send_trouble = text


def _controller(classes: int, problem: int, before: BusState) -> BusState:
    """State of a controller after an error frame, by its classes and by its second byte."""
    if classes & _BUS_OFF:
        return BusState.BUS_OFF
    if classes & _RESTARTED:
        return BusState.ACTIVE
    if classes & _PROBLEM and problem & _PASSIVE:
        return BusState.ERROR_PASSIVE
    if classes & _PROBLEM and problem & (_ACTIVE | _WARNING):
        return BusState.ACTIVE
    return before


def _packed(filters: Filters | None) -> bytes:
    """Array of struct can_filter; extended data frames only, or everything."""
    if filters is None:
        return struct.pack("=II", 0, 0)
    flags = socket.CAN_EFF_FLAG
    return b"".join(struct.pack("=II", i | flags, mask | flags | socket.CAN_RTR_FLAG) for i, mask in filters)
