"""The 29-bit identifiers: ARINC-825-style fields, with the actuator number in one place.

======  =====  ===================================================================================
bits    field  here
======  =====  ===================================================================================
28-26   LCC    logical communication channel: 2 normal operation, 6 test and maintenance
25-19   FID    source function: 100 actuator, 101 monitor, 102 tester
18      RSD    reserved, 0
17      LCL    1: local to this bus, no gateway passes it on
16      PVT    1: the payload is private to these nodes (defined by the DBC, not by ARINC)
15-2    DOC    data object: message code (bits 15-8) and actuator number 0…63 (bits 7-2)
1-0     RCI    redundancy channel, 0
======  =====  ===================================================================================

DOC is unique for each message of each actuator, and so it is also the Data ID of the E2E protection.
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np

N_ACTUATORS = 64
_ACTUATOR_SHIFT = 2
ACTUATOR_MASK = (N_ACTUATORS - 1) << _ACTUATOR_SHIFT
MESSAGE_MASK = 0x1FFFFFFF & ~ACTUATOR_MASK  # what is left of an identifier is that of its DBC message

Id = TypeVar("Id", int, np.ndarray)


class Identifier(NamedTuple):
    """The fields of an identifier."""

    lcc: int
    fid: int
    lcl: int
    pvt: int
    doc: int
    rci: int

    @property
    def actuator(self) -> int:
        """Actuator number, 0…63."""
        return self.doc % N_ACTUATORS


def parse(frame_id: int) -> Identifier:
    """Fields of a 29-bit identifier."""
    return Identifier(
        lcc=frame_id >> 26 & 0x7,
        fid=frame_id >> 19 & 0x7F,
        lcl=frame_id >> 17 & 1,
        pvt=frame_id >> 16 & 1,
        doc=frame_id >> 2 & 0x3FFF,
        rci=frame_id & 0x3,
    )


def message_id(frame_id: Id) -> Id:
    """Identifier of the DBC message, that is, of its actuator 0. For an int or an array."""
    return frame_id & MESSAGE_MASK


def actuator(frame_id: Id) -> Id:
    """Actuator number 0…63 of an identifier. For an int or an array."""
    return (frame_id & ACTUATOR_MASK) >> _ACTUATOR_SHIFT


def with_actuator(frame_id: int, number: int) -> int:
    """Identifier of the message `frame_id` for another actuator."""
    if not 0 <= number < N_ACTUATORS:
        raise ValueError(f"actuator number {number} is not in 0…{N_ACTUATORS - 1}")
    return frame_id & MESSAGE_MASK | number << _ACTUATOR_SHIFT


def data_id(frame_id: int) -> int:
    """AUTOSAR E2E Data ID of a frame: the DOC field."""
    return frame_id >> 2 & 0x3FFF
