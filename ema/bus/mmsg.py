"""Many CAN frames with one system call: Linux' recvmmsg and sendmmsg on a raw CAN socket, into and out of numpy.

One call for each frame (`socket.recvmsg`) would be most of the cost of receiving. A batch is one call, and its control
messages (the kernel's receive times, dropped frames) are read as arrays.
"""

from __future__ import annotations

import ctypes
import os
import socket
from typing import NamedTuple

import numpy as np

from ema.core import frames as fr
from ema.core.frames import FrameFlag

from .port import MAX_BATCH

# asm-generic/socket.h; Python's socket module does not name them.
SO_TIMESTAMPNS = 35
SO_RXQ_OVFL = 40

CLASSIC_SIZE, FD_SIZE = 16, 72  # struct can_frame, struct canfd_frame
CANFD_FRAME = np.dtype(
    [("id", "=u4"), ("length", "u1"), ("flags", "u1"), ("reserved", "u1", (2,)), ("data", "u1", (fr.MAX_DATA,))]
)
_CANFD_BRS, _CANFD_ESI = 1, 2  # linux/can.h

# By the upper three bits of the kernel's identifier: what kind of frame, and which bits are the identifier itself.
_KIND_FLAGS = np.array(
    [
        FrameFlag.EXTENDED * (kind >> 2 & 1) | FrameFlag.REMOTE * (kind >> 1 & 1) | FrameFlag.ERROR * (kind & 1)
        for kind in range(8)
    ],
    np.uint8,
)
_ID_MASK = np.where(np.arange(8) & 4, np.uint32(socket.CAN_EFF_MASK), np.uint32(socket.CAN_SFF_MASK))
# By the two lower bits of the kernel's flags of a CAN FD frame.
_FD_FLAGS = np.array(
    [
        FrameFlag.FD | FrameFlag.BRS * (flags & _CANFD_BRS) | FrameFlag.ESI * (flags >> 1 & 1)
        for flags in range(_CANFD_BRS + _CANFD_ESI + 1)
    ],
    np.uint8,
)
_MOST_DATA = np.array([8, fr.MAX_DATA], np.uint8)  # bytes, of a classic and of a CAN FD frame
_WITHIN = np.where(np.arange(fr.MAX_DATA) < np.arange(fr.MAX_DATA + 1)[:, None], np.uint8(0xFF), np.uint8(0))
_S_NS = np.uint64(1_000_000_000)


class _Iovec(ctypes.Structure):
    _fields_ = [("base", ctypes.c_size_t), ("size", ctypes.c_size_t)]


class _MsgHdr(ctypes.Structure):
    _fields_ = [
        ("name", ctypes.c_size_t),
        ("name_size", ctypes.c_uint32),
        ("iov", ctypes.c_size_t),
        ("n_iov", ctypes.c_size_t),
        ("control", ctypes.c_size_t),
        ("control_size", ctypes.c_size_t),
        ("flags", ctypes.c_int),
    ]


class _MmsgHdr(ctypes.Structure):
    _fields_ = [("message", _MsgHdr), ("size", ctypes.c_uint)]


class _TimeControl(ctypes.Structure):
    """Control message SCM_TIMESTAMPNS."""

    _fields_ = [
        ("size", ctypes.c_size_t),
        ("level", ctypes.c_int),
        ("kind", ctypes.c_int),
        ("seconds", ctypes.c_long),
        ("nanoseconds", ctypes.c_long),
    ]


class _DropControl(ctypes.Structure):
    """Control message SO_RXQ_OVFL: frames dropped at this socket since it was opened."""

    _fields_ = [
        ("size", ctypes.c_size_t),
        ("level", ctypes.c_int),
        ("kind", ctypes.c_int),
        ("n_dropped", ctypes.c_uint32),
        ("_pad", ctypes.c_uint32),
    ]


class _Control(ctypes.Structure):
    """What the kernel puts there, in its order: always the time, and the drops once there are any."""

    _fields_ = [("time", _TimeControl), ("drop", _DropControl)]


_STAMPED = np.array([socket.SOL_SOCKET, SO_TIMESTAMPNS], np.int32).view(np.uint8)  # level and kind of _TimeControl
_libc = ctypes.CDLL(None, use_errno=True)


class Received(NamedTuple):
    """One batch as the kernel gave it; the arrays are overwritten by the next call."""

    raw: np.ndarray  # shape (n,), CANFD_FRAME
    size: np.ndarray  # bytes of each
    t_ns: np.ndarray  # kernel's receive time, 0 where it gave none
    n_dropped: int  # in all, as of the last frame; 0 when there was none yet

    def where(self, keep: np.ndarray) -> Received:
        """Only the frames where `keep` is true."""
        return Received(self.raw[keep], self.size[keep], self.t_ns[keep], self.n_dropped)


class Batch:
    """Buffers for MAX_BATCH frames and the headers that point at them: to receive or to send, not both."""

    def __init__(self) -> None:
        self.raw = np.zeros(MAX_BATCH, CANFD_FRAME)
        control = np.zeros(MAX_BATCH, np.dtype(_Control))
        # Cleared and copied as plain bytes: field by field, it would cost ten times as much.
        self._control_bytes = control.view(np.uint8).reshape(MAX_BATCH, -1)
        time, self._drop = control["time"], control["drop"]
        self._seconds, self._nanoseconds = (time[name].view(np.uint64) for name in ("seconds", "nanoseconds"))
        self._kind_of_time = self._control_bytes[:, _TimeControl.level.offset : _TimeControl.seconds.offset]
        iovecs = np.zeros(MAX_BATCH, np.dtype(_Iovec))
        iovecs["base"] = self.raw.ctypes.data + FD_SIZE * np.arange(MAX_BATCH)
        iovecs["size"] = FD_SIZE
        self._iovecs = iovecs
        self._headers = np.zeros(MAX_BATCH, np.dtype(_MmsgHdr))
        message = self._message = self._headers["message"]
        message["iov"] = iovecs.ctypes.data + iovecs.itemsize * np.arange(MAX_BATCH)
        message["n_iov"] = 1
        message["control"] = control.ctypes.data + control.itemsize * np.arange(MAX_BATCH)
        message["control_size"] = control.itemsize
        self._header_bytes = self._headers.view(np.uint8).reshape(MAX_BATCH, -1)
        self._clean = self._header_bytes.copy()
        self._sizes, self._address = self._headers["size"], ctypes.c_void_p(self._headers.ctypes.data)
        self._n_used = 0  # headers and controls that the last call has written to

    def receive(self, fileno: int, n_most: int = MAX_BATCH) -> Received:
        """Frames that wait at a non-blocking socket, up to `n_most`; OSError from the kernel, EAGAIN for none."""
        used = self._n_used
        self._control_bytes[:used] = 0
        self._header_bytes[:used] = self._clean[:used]
        self._n_used = 0
        n = _libc.recvmmsg(fileno, self._address, n_most, 0, None)
        if n < 0:
            raise _error()
        self._n_used = n
        t_ns = self._seconds[:n] * _S_NS + self._nanoseconds[:n]
        untold = self._kind_of_time[:n] != _STAMPED
        if untold.any():
            t_ns[untold.any(axis=1)] = 0
        drop = self._drop[n - 1]
        told = drop["level"] == socket.SOL_SOCKET and drop["kind"] == SO_RXQ_OVFL
        return Received(self.raw[:n], self._sizes[:n], t_ns, int(drop["n_dropped"]) if told else 0)

    def send(self, fileno: int, frames: np.ndarray) -> int:
        """Send up to MAX_BATCH frames, FRAME_DTYPE; how many were taken, at least one, else OSError."""
        n = min(len(frames), MAX_BATCH)
        self._iovecs["size"][:n] = to_kernel(frames[:n], self.raw[:n])
        self._message["control"][:n] = 0
        self._message["control_size"][:n] = 0
        taken = _libc.sendmmsg(fileno, self._address, n, 0)
        if taken < 0:
            raise _error()
        return int(taken)


def from_kernel(received: Received) -> np.ndarray:
    """Frames in FRAME_DTYPE, error frames included; what is neither of CAN's two sizes must have been taken out."""
    raw, is_fd = received.raw, (received.size == FD_SIZE).view(np.uint8)
    kind = raw["id"] >> 29
    out = np.empty(raw.size, fr.FRAME_DTYPE)
    out["t_ns"] = received.t_ns
    out["id"] = raw["id"] & _ID_MASK.take(kind)
    out["flags"] = _KIND_FLAGS.take(kind) | _FD_FLAGS.take(raw["flags"] & 3) * is_fd
    length = out["length"] = np.minimum(raw["length"], _MOST_DATA.take(is_fd))
    # Beyond the length is what the sender, or the frame before in the same buffer, has left there.
    np.bitwise_and(raw["data"], _WITHIN.take(length, axis=0), out=out["data"])
    return out


def to_kernel(frames: np.ndarray, raw: np.ndarray) -> np.ndarray:
    """Write frames, FRAME_DTYPE, into kernel frames of the same shape; returns the size of each. [B]"""
    flags = frames["flags"]
    raw["id"] = (
        frames["id"]
        | ((flags & FrameFlag.EXTENDED) != 0) * np.uint32(socket.CAN_EFF_FLAG)
        | ((flags & FrameFlag.REMOTE) != 0) * np.uint32(socket.CAN_RTR_FLAG)
    )
    raw["length"] = frames["length"]
    raw["flags"] = ((flags & FrameFlag.BRS) != 0) * _CANFD_BRS | ((flags & FrameFlag.ESI) != 0) * _CANFD_ESI
    raw["reserved"] = 0
    raw["data"] = frames["data"]
    return np.where(flags & FrameFlag.FD, FD_SIZE, CLASSIC_SIZE)


def _error() -> OSError:
    number = ctypes.get_errno()
    return OSError(number, os.strerror(number))
