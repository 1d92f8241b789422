"""One small tree of errors of use. Each message says what, where and what would be right, in one line.

Bad *data* is not an error: an estimate made from bad data carries a status and a reason.
"""

from __future__ import annotations


class EmaError(Exception):
    """Base of every error a user can cause or meet; the command line prints it as one line, exit status 2."""

    def __init__(self, message: str):
        super().__init__(" ".join(message.split()))


class ConfigError(EmaError):
    """A configuration file is missing, unreadable, or a key is unknown, missing, of the wrong unit or out of range."""


class RecordError(EmaError):
    """A record cannot be read, or lacks what the command needs: channel, unit, length, finite values."""


class NoCycleError(RecordError):
    """A log is sound, but no cycle in it is whole: it may end, or begin, in the middle of one."""


class BundleError(EmaError):
    """A bundle is damaged, foreign, newer than this software, or made for another actuator."""


class BusError(EmaError):
    """A bus cannot be opened, or a frame cannot be encoded."""


class OccupiedError(BusError):
    """Another program does on this bus what this one would."""


class LogError(EmaError):
    """A log cannot be written or read."""


class Failure(EmaError):
    """What ran well cannot go on: exit status 1, so that a service manager starts it again."""


class NegativeAnswer(EmaError):
    """The command ran and its answer is no (a failed check or comparison): exit status 1."""
