"""The one place of every status and reason that frames, logs and estimates carry."""

from __future__ import annotations

from enum import IntEnum, IntFlag


class Status(IntEnum):
    """How far an estimate can be trusted."""

    VALID = 0
    DEGRADED = 1  # an estimate, made from less than all of the data or near a limit of the method
    INVALID = 2  # data seen, but no estimate that could be used
    NOT_ESTIMATED = 3  # nothing tried


class Reason(IntFlag):
    """Why a status is not VALID, or what else a reader should know. Bits as broadcast."""

    LOST_FRAMES = 1 << 0
    CORRUPT_FRAMES = 1 << 1
    REPEATED_FRAMES = 1 << 2
    REORDERED_FRAMES = 1 << 3
    GAP_AT_SCHEDULE = 1 << 4  # a scheduled point of the envelope has no data
    NO_START = 1 << 5  # cycle start frame missing
    NO_END = 1 << 6
    SATURATED = 1 << 7
    START_STATE_UNKNOWN = 1 << 8
    MODEL_IN_DOUBT = 1 << 9  # residual test failed
    AT_BOUND = 1 << 10  # some k at 0 or 1
    UNSEPARABLE = 1 << 11  # the data cannot tell some k apart
    TIMEOUT = 1 << 12
    AUTHENTICATION = 1 << 13  # frames in this actuator's name were refused as not authentic
    KERNEL_DROPS = 1 << 14
    OUT_OF_RANGE = 1 << 15  # outside the range the model was built for

    @property
    def names(self) -> list[str]:
        """Names of the bits set, in order of the bits, lower case."""
        return [reason.name.lower() for reason in self if reason.name]


class ServiceState(IntEnum):
    """State of the daemon in its heartbeat."""

    STARTING = 0
    RUNNING = 1
    DEGRADED = 2
    STOPPING = 3


class LogState(IntEnum):
    """State of the daemon's log in its heartbeat."""

    OK = 0
    FULL = 1  # no room: nothing is written until there is
    FAILED = 2  # the device refuses writes for another reason
    OFF = 3  # none configured


class AlarmLevel(IntEnum):
    """How urgent an alarm is."""

    NONE = 0
    WATCH = 1  # look at it at the next occasion
    ALARM = 2  # repair before the next flight


class AlarmState(IntEnum):
    """State of an alarm, after ISA-18.2."""

    INACTIVE = 0  # normal
    ACTIVE = 1  # the condition holds, nobody has acknowledged it
    ACKNOWLEDGED = 2  # the condition holds, somebody has seen it
    LATCHED_CLEARED = 3  # the condition has gone, the alarm stands until acknowledged or, where it latches, cleared
    SHELVED = 4  # taken out of sight for some time by an operator
