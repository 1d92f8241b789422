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
    """Buffers for MAX_BATCH frames and the headers that point at them."""

    def __init__(self) -> None:
        self.raw = np.zeros(MAX_BATCH, CANFD_FRAME)
        self._control = np.zeros(MAX_BATCH, np.dtype(_Control))
        self._control_bytes = self._control.view(np.uint8)  # cleared field by field, it would cost ten times as much
        iovecs = np.zeros(MAX_BATCH, np.dtype(_Iovec))
        iovecs["base"] = self.raw.ctypes.data + FD_SIZE * np.arange(MAX_BATCH)
        iovecs["size"] = FD_SIZE
        self._iovecs = iovecs
        self._headers = np.zeros(MAX_BATCH, np.dtype(_MmsgHdr))
        message = self._message = self._headers["message"]
        message["iov"] = iovecs.ctypes.data + iovecs.itemsize * np.arange(MAX_BATCH)
        message["n_iov"] = 1
        self._control_at = self._control.ctypes.data + self._control.itemsize * np.arange(MAX_BATCH)

    def receive(self, fileno: int, n_most: int = MAX_BATCH) -> Received:
        """Frames that wait at a non-blocking socket, up to `n_most`; OSError from the kernel, EAGAIN for none."""
        self._control_bytes[: n_most * self._control.itemsize] = 0
        self._message["control"][:n_most] = self._control_at[:n_most]
        self._message["control_size"][:n_most] = self._control.itemsize
        n = _libc.recvmmsg(fileno, ctypes.c_void_p(self._headers.ctypes.data), n_most, 0, None)
        if n < 0:
            raise _error()
        time, drop = self._control["time"][:n], self._control["drop"][:n]
        t_ns = np.where(
            (time["level"] == socket.SOL_SOCKET) & (time["kind"] == SO_TIMESTAMPNS),
            time["seconds"].astype(np.uint64) * np.uint64(1_000_000_000) + time["nanoseconds"].astype(np.uint64),
            np.uint64(0),
        )
        last = drop[n - 1]
        told = last["level"] == socket.SOL_SOCKET and last["kind"] == SO_RXQ_OVFL
        return Received(self.raw[:n], self._headers["size"][:n], t_ns, int(last["n_dropped"]) if told else 0)

    def send(self, fileno: int, frames: np.ndarray) -> int:
        """Send up to MAX_BATCH frames, FRAME_DTYPE; how many were taken, at least one, else OSError."""
        n = min(len(frames), MAX_BATCH)
        self._iovecs["size"][:n] = to_kernel(frames[:n], self.raw[:n])
        self._message["control"][:n] = 0
        self._message["control_size"][:n] = 0
        taken = _libc.sendmmsg(fileno, ctypes.c_void_p(self._headers.ctypes.data), n, 0)
        if taken < 0:
            raise _error()
        return int(taken)


def from_kernel(received: Received) -> np.ndarray:
    """Frames in FRAME_DTYPE, error frames included; what is neither of CAN's two sizes must have been taken out."""
    raw, is_fd = received.raw, received.size == FD_SIZE
    kind = raw["id"] >> 29
    out = np.empty(raw.shape, fr.FRAME_DTYPE)
    out["t_ns"] = received.t_ns
    out["id"] = raw["id"] & _ID_MASK[kind]
    out["flags"] = _KIND_FLAGS[kind] | is_fd * _FD_FLAGS[raw["flags"] & 3]
    out["length"] = np.minimum(raw["length"], np.where(is_fd, fr.MAX_DATA, 8))
    out["data"] = raw["data"]
    short = np.flatnonzero(out["length"] < fr.MAX_DATA)
    if short.size:  # the rest is what the sender or the frame before has left there
        out["data"][short] *= np.arange(fr.MAX_DATA) < out["length"][short, None]
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
