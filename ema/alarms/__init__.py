"""Alarms in the words of ISA-18.2 and EEMUA 191: conditions, states, what an operator may do. No I/O, no clock."""

from .alarms import Alarms
from .causes import CAUSES, Cause, Kind
from .change import Change
from .command import Action, Command, Heard, Warmth, in_order
from .judge import Judged
from .point import Point
from .settings import AlarmSettings

__all__ = [
    "CAUSES", "Action", "AlarmSettings", "Alarms", "Cause", "Change", "Command", "Heard", "Judged", "Kind", "Point",
    "Warmth", "in_order",
]  # fmt: skip
