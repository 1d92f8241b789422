"""python-can messages to and from frames; a refused frame is an error frame there, so that nobody takes its data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .frames import MAX_DATA, FrameFlag

if TYPE_CHECKING:
    import can

_NS = 1_000_000_000


def message(frame: Any, channel: Any = None) -> can.Message:
    """python-can message of one frame (a scalar of FRAME_DTYPE)."""
    import can  # with what it reads other tools' logs by: half a second that a command on our own logs has no need of

    flags = int(frame["flags"])
    seconds, ns = divmod(int(frame["t_ns"]), _NS)
    return can.Message(
        timestamp=seconds + ns / _NS,
        arbitration_id=int(frame["id"]),
        is_extended_id=bool(flags & FrameFlag.EXTENDED),
        is_remote_frame=bool(flags & FrameFlag.REMOTE),
        is_error_frame=bool(flags & (FrameFlag.ERROR | FrameFlag.REFUSED)),
        is_fd=bool(flags & FrameFlag.FD),
        bitrate_switch=bool(flags & FrameFlag.BRS),
        error_state_indicator=bool(flags & FrameFlag.ESI),
        is_rx=not flags & FrameFlag.TX,
        channel=channel,
        dlc=int(frame["length"]),
        data=None if flags & FrameFlag.REMOTE else frame["data"][: frame["length"]].tobytes(),
    )


def fill(frame: Any, message: can.Message) -> None:
    """Write a python-can message into one frame of a zeroed batch; ValueError when it does not fit."""
    data = message.data
    if len(data) > MAX_DATA or message.dlc > MAX_DATA:
        raise ValueError(f"a frame of {max(len(data), message.dlc)} bytes is neither CAN nor CAN FD")
    if not 0 <= message.timestamp < 1e10:
        raise ValueError(f"time {message.timestamp} s is before 1970 or beyond 2286")
    seconds = int(message.timestamp)
    frame["t_ns"] = seconds * _NS + round((message.timestamp - seconds) * _NS)  # no digit of the float is lost
    frame["id"] = message.arbitration_id
    frame["flags"] = (
        FrameFlag.EXTENDED * message.is_extended_id
        | FrameFlag.REMOTE * message.is_remote_frame
        | FrameFlag.ERROR * message.is_error_frame
        | FrameFlag.FD * message.is_fd
        | FrameFlag.BRS * message.bitrate_switch
        | FrameFlag.ESI * message.error_state_indicator
        | FrameFlag.TX * (not message.is_rx)
    )
    frame["length"] = message.dlc
    frame["data"][: len(data)] = data
