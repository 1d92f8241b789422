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
    LATE = 1 << 16  # sent after its budget, or after one of a newer cycle
    CURRENT_A = 1 << 17  # from here on: the channel reads what the actuator cannot do, so nothing is made of it
    CURRENT_B = 1 << 18
    CURRENT_C = 1 << 19
    CURRENT_SUM = 1 << 20  # the phases of a wye sum to zero, and these do not; which one is wrong is not known
    USER_POSITION = 1 << 21
    ROTOR_ANGLE = 1 << 22
    TWO_SPEAKERS = 1 << 23  # another sender in this actuator's name: whose data these are is not known

    @property
    def names(self) -> list[str]:
        """Names of the bits set, in order of the bits, lower case."""
        return [reason.name.lower() for reason in self if reason.name]


IMPLAUSIBLE = (
    Reason.CURRENT_A | Reason.CURRENT_B | Reason.CURRENT_C | Reason.CURRENT_SUM | Reason.USER_POSITION
    | Reason.ROTOR_ANGLE
)  # fmt: skip


class BusState(IntEnum):
    """State of a bus as its controller or interface tells it."""

    ACTIVE = 0
    ERROR_PASSIVE = 1  # many errors: the controller may no longer mark them for others
    BUS_OFF = 2  # so many that it takes no part
    DOWN = 3  # the interface is down or gone


class ServiceState(IntEnum):
    """State of the daemon in its heartbeat."""

    STARTING = 0
    RUNNING = 1
    DEGRADED = 2
    STOPPING = 3
    STANDBY = 4  # listens and logs; another monitor speaks


class Lapse(IntEnum):
    """What the configuration promises and does not happen, the gravest first. Numbers as in the heartbeat."""

    NONE = 0
    BUS_DOWN = 1  # the interface is down or gone
    BUS_OFF = 2
    ERROR_PASSIVE = 3
    FLOODED = 4  # more frames of others than this process can look at
    LOG = 5  # not written
    WORKER = 6  # the process of an identifier does not answer
    SECOND_MONITOR = 7  # another one estimates the faults of the same actuator
    SILENT = 8  # an actuator is not heard at all
    NO_CYCLES = 9  # … sends neither CycleStart nor CycleEnd
    NO_CURRENTS = 10
    NO_MOTION = 11
    NO_SUPPLY = 12
    CHANNEL = 13  # … sends what it cannot do: a dead sensor
    NO_ESTIMATE = 14  # an identifier has no usable estimate
    FRAMES = 15  # frames were missing or refused since the last heartbeat


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
