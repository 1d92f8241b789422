"""How long a CAN FD frame occupies the bus, and how much of a bus its messages take.

Bits of a frame with a 29-bit identifier and bit-rate switch (ISO 11898-1:2015). Stuff bits depend on the data; at worst
every fifth bit of the stuffed part is one.
"""

from __future__ import annotations

from collections.abc import Iterable

from .codec import Codec, Message
from .nodes import Kinds
from .sealer import seal_period

_ARBITRATION = 36  # start of frame to bit-rate switch
_END = 13  # CRC delimiter, acknowledgement, end of frame, intermission
_CONTROL = 5  # error state indicator, length code
_CRC = {True: 4 + 17 + 6, False: 4 + 21 + 7}  # stuff count, CRC, fixed stuff bits; True: up to 16 bytes


def frame_time(length: int, nominal: float, data: float, *, worst: bool = False) -> float:
    """Time one frame takes. [s]

    Parameters
    ----------
    length : int
        Payload. [byte]
    nominal, data : float
        Bit rates of arbitration and data phase. [bit/s]
    worst : bool
        With as many stuff bits as there can be; else with none.
    """
    payload = _CONTROL + 8 * length
    stuff_slow, stuff_fast = ((_ARBITRATION - 1) // 4, payload // 4) if worst else (0, 0)
    return (_ARBITRATION + stuff_slow + _END) / nominal + (payload + stuff_fast + _CRC[length <= 16]) / data


def load(messages: Iterable[Message], nominal: float, data: float, *, worst: bool = False) -> float:
    """Share of the bus that periodic messages take while they are sent, 1 is all of it."""
    return sum(frame_time(m.length, nominal, data, worst=worst) / m.period for m in messages if m.period)


def sealed(messages: Iterable[Message], codec: Codec) -> list[Message]:
    """Periodic messages with the seals that authentication sends for them."""
    periodic = [m for m in messages if m.period]
    kinds = Kinds(codec)
    return periodic + [kinds.seal(m.sender)._replace(period=seal_period(m)) for m in periodic]
