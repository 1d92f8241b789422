"""CAN over UDP multicast on this machine's loopback, in python-can's own format, so that its tools take part.

python-can's bus of the same name does this too, but joins on the default route's interface (none on a machine
without a network, and beyond this machine on one with), reads one frame per call, and cannot tell its own frames.
"""

from __future__ import annotations

import socket
import struct
import time
from contextlib import suppress
from typing import Any

import msgpack
import numpy as np

from ema.core import frames as fr
from ema.core.errors import BusError
from ema.core.frames import FrameFlag

from .flood import Flood
from .mmsg import SO_RXQ_OVFL, SO_TIMESTAMPNS
from .port import MAX_BATCH, RECEIVE_BUFFER, Filters, Port, ask_for_buffer, passes

GROUP = "239.74.163.2"  # python-can's
PORT = 43113
_LOOPBACK = "127.0.0.1"
_MAX_BYTES = 512  # a packed frame of 64 bytes takes about 210
_CONTROL = socket.CMSG_SPACE(16) + socket.CMSG_SPACE(4)  # receive time and drop count
_MAX_FOREIGN = 4 * MAX_BATCH  # looked at in one read before the processor is given back
_MAPS = tuple(bytes([kind]) for kind in (*range(0x80, 0x90), 0xDE))  # how a packed map begins
_KEY = b"\xaearbitration_id"
_SHORT, _LONG = 0x10000, 0xCE  # smaller identifiers are packed shorter than after this mark of 32 bits
_KEY_AT = len(b"\x8b\xa9timestamp\xcb") + 8
_MARK_AT = _KEY_AT + len(_KEY)
_FLAG_BITS = {
    "is_extended_id": FrameFlag.EXTENDED,
    "is_remote_frame": FrameFlag.REMOTE,
    "is_error_frame": FrameFlag.ERROR,
    "is_fd": FrameFlag.FD,
    "bitrate_switch": FrameFlag.BRS,
    "error_state_indicator": FrameFlag.ESI,
}


class MulticastPort(Port):
    """A multicast group on the loopback interface.

    Parameters
    ----------
    group : str
        IPv4 multicast address. BusError when it cannot be joined.
    filters : Filters, optional
        Extended identifiers to receive. Default: everything.
    receive_buffer : int
        Asked of the kernel; when it grants less, an event says so and what to do. [B]
    """

    def __init__(
        self,
        group: str = GROUP,
        filters: Filters | None = None,
        port: int = PORT,
        receive_buffer: int = RECEIVE_BUFFER,
    ):
        super().__init__(f"udp_multicast:{group}")
        self._in = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._trouble = False
        self._filters = filters
        self._flood = Flood()
        self._wanted: dict[int, set[int]] = {}  # identifiers by mask
        self._are_long = all(frame_id >= _SHORT for frame_id, _ in filters or ())
        for frame_id, mask in filters or ():
            self._wanted.setdefault(mask, set()).add(frame_id & mask)
        try:
            here, there = socket.inet_aton(_LOOPBACK), socket.inet_aton(group)
            for option in (socket.SO_REUSEADDR, socket.SO_REUSEPORT, SO_TIMESTAMPNS, SO_RXQ_OVFL):
                self._in.setsockopt(socket.SOL_SOCKET, option, 1)
            warning = ask_for_buffer(self._in, receive_buffer)
            self._in.bind((group, port))
            self._in.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, struct.pack("4s4s", there, here))
            self._out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, here)
            self._out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)  # never leaves this machine
            self._out.bind((_LOOPBACK, 0))
            self._out.connect((group, port))
        except OSError as error:
            self.close()
            raise BusError(f"bus {self.name} cannot be opened ({error.strerror or error})") from error
        if warning:
            self._events.append(f"{self.name}: {warning}")
        self._own_address = self._out.getsockname()

    def read(self, timeout: float) -> np.ndarray:
        """See Port."""
        end = time.monotonic() + timeout
        while True:
            frames = self._arrived()
            left = end - time.monotonic()
            if frames.size or left <= 0:
                self.counters.n_received += frames.size
                return frames
            self._in.settimeout(left)
            with suppress(TimeoutError):
                self._in.recv(1, socket.MSG_PEEK)

    def write(self, frames: np.ndarray) -> int:
        """See Port."""
        n_sent = 0
        for frame in frames:
            try:
                self._out.send(_pack(frame))
            except OSError as error:
                if not self._trouble:
                    self._events.append(f"{self.name}: {error.strerror}")
                self._trouble = True
                break
            n_sent += 1
            self._trouble = False
        self.counters.n_sent += n_sent
        self.counters.n_send_failed += frames.size - n_sent
        return n_sent

    def close(self) -> None:
        """See Port."""
        self._in.close()
        self._out.close()

    def _arrived(self) -> np.ndarray:
        """What others have sent and waits here."""
        self._in.setblocking(False)
        rows: list[tuple[int, int, int, int]] = []
        payloads: list[bytes] = []
        n_foreign = 0
        while len(rows) < MAX_BATCH and n_foreign < _MAX_FOREIGN:
            try:
                packed, control, _, sender = self._in.recvmsg(_MAX_BYTES, _CONTROL)
            except BlockingIOError:
                break
            if sender == self._own_address:
                continue
            t_ns = self._told(control)
            n_foreign += 1
            if not packed.startswith(_MAPS):
                self.counters.n_unreadable += 1
                continue
            if self._is_foreign(packed):
                continue
            try:
                frame_id, flags, length, data = _unpack(packed)
            except (ValueError, TypeError, KeyError):  # whatever somebody sends to the group
                self.counters.n_unreadable += 1
                continue
            if flags & FrameFlag.ERROR:
                self.counters.n_error_frames += 1
                continue
            n_foreign -= 1
            rows.append((t_ns, frame_id, flags, length))
            payloads.append(data)
        out = fr.empty(len(rows))
        if rows:
            out["t_ns"], out["id"], out["flags"], out["length"] = np.array(rows, np.uint64).T
            out["data"] = np.frombuffer(b"".join(payloads), np.uint8).reshape(-1, fr.MAX_DATA)
        wanted = out if self._filters is None else out[passes(out, self._filters)]
        self._flood.note(n_foreign + out.size - wanted.size, self.counters.kernel_drops, time.monotonic())
        self._flooded = self._flood.flooded
        return wanted

    def _is_foreign(self, packed: bytes) -> bool:
        """Whether a frame in python-can's usual layout is none that is received; seen without unpacking it."""
        if not self._wanted or packed[_KEY_AT:_MARK_AT] != _KEY or len(packed) < _MARK_AT + 5:
            return False
        if packed[_MARK_AT] != _LONG:
            return self._are_long
        frame_id = int.from_bytes(packed[_MARK_AT + 1 : _MARK_AT + 5], "big")
        return not any(frame_id & mask in ids for mask, ids in self._wanted.items())

    def _told(self, control: list[tuple[int, int, bytes]]) -> int:
        """The kernel's receive time [ns]; its count of dropped datagrams goes to the counters."""
        t_ns = 0
        for _level, kind, data in control:
            if kind == SO_TIMESTAMPNS:
                seconds, ns = struct.unpack("=qq", data)
                t_ns = seconds * 10**9 + ns
            elif kind == SO_RXQ_OVFL:
                (self.counters.kernel_drops,) = struct.unpack("=I", data)
        return t_ns


def _pack(frame: Any) -> bytes:
    """One frame (a scalar of FRAME_DTYPE) as python-can packs it."""
    flags, length = int(frame["flags"]), int(frame["length"])
    packed: bytes = msgpack.packb(
        {
            "timestamp": int(frame["t_ns"]) / 1e9,
            "arbitration_id": int(frame["id"]),
            **{name: bool(flags & bit) for name, bit in _FLAG_BITS.items()},
            "channel": None,
            "dlc": length,
            "data": b"" if flags & FrameFlag.REMOTE else frame["data"][:length].tobytes(),
        }
    )
    return packed


def _unpack(packed: bytes) -> tuple[int, int, int, bytes]:
    """Identifier, flags, length and data with zeros behind; ValueError, TypeError or KeyError if it is no frame."""
    said = msgpack.unpackb(packed)
    frame_id, length, data = said["arbitration_id"], said["dlc"], said["data"] or b""
    flags = sum(bit for name, bit in _FLAG_BITS.items() if said[name] is True)
    if not (
        type(frame_id) is int
        and type(length) is int
        and type(data) is bytes
        and 0 <= frame_id <= 0x1FFFFFFF
        and 0 <= length <= fr.MAX_DATA
        and (len(data) == length or flags & FrameFlag.REMOTE)
    ):
        raise ValueError("not a CAN frame")
    return frame_id, flags, length, data.ljust(fr.MAX_DATA, b"\0")
