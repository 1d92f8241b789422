"""The AUTOSAR E2E state machine of one stream of frames: does the stream as a whole deserve trust?

A window of the last check results decides; the names and rules are those of the E2E Protocol Specification
(E2E_SM), with one addition: a stream that times out goes back to NO_DATA and starts again.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from enum import IntEnum
from typing import NamedTuple


class StreamState(IntEnum):
    """State of a stream."""

    NO_DATA = 0  # nothing received, or nothing new in time
    INIT = 1  # too few frames to judge
    VALID = 2
    INVALID = 3  # too many errors in the window


class Result(IntEnum):
    """What the check of one frame says about its stream (E2E_PCheckStatusType)."""

    OK = 0
    ERROR = 1  # CRC or length wrong
    OTHER = 2  # repeated or wrong sequence: neither good nor an error


class Limits(NamedTuple):
    """E2E_SMConfigType: how many results of a window make a stream valid, and keep it so."""

    window: int = 10
    min_ok_init: int = 3
    max_error_init: int = 1
    min_ok_valid: int = 5
    max_error_valid: int = 2
    min_ok_invalid: int = 8
    max_error_invalid: int = 1


DEFAULT_LIMITS = Limits()


@dataclass(slots=True)
class StateMachine:
    """State of one stream, updated with each check result."""

    limits: Limits = DEFAULT_LIMITS
    state: StreamState = StreamState.NO_DATA
    window: deque[Result] = field(default_factory=deque)

    @property
    def steady(self) -> bool:
        """Whether another OK changes nothing."""
        return self.state is StreamState.VALID and self.window.count(Result.OK) == self.limits.window

    def update(self, result: Result) -> StreamState:
        """Take one check result."""
        self.window.append(result)
        if len(self.window) > self.limits.window:
            self.window.popleft()
        n_ok, n_error = self.window.count(Result.OK), self.window.count(Result.ERROR)
        limits = self.limits
        match self.state:
            case StreamState.NO_DATA:
                if result is Result.OK:
                    self.state = StreamState.INIT
            case StreamState.INIT:
                if n_error > limits.max_error_init:
                    self.state = StreamState.INVALID
                elif n_ok >= limits.min_ok_init:
                    self.state = StreamState.VALID
            case StreamState.VALID:
                full = len(self.window) == limits.window
                if n_error > limits.max_error_valid or (full and n_ok < limits.min_ok_valid):
                    self.state = StreamState.INVALID
            case StreamState.INVALID:
                if n_error <= limits.max_error_invalid and n_ok >= limits.min_ok_invalid:
                    self.state = StreamState.VALID
        return self.state

    def time_out(self) -> None:
        """Nothing new in time: start again."""
        self.window.clear()
        self.state = StreamState.NO_DATA
