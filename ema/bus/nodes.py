"""Who is on the bus: a node is a sender of the DBC and the actuator number it speaks as, or for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from . import identifiers
from .codec import Codec, Message

_KINDS = ("Seal", "Session", "Challenge")


class Node(NamedTuple):
    """What sends: actuator 3, or the monitor in what concerns actuator 3."""

    role: str  # sender of the DBC
    number: int  # 0…63

    def __str__(self) -> str:
        return f"{self.role.lower()} {self.number}"


class Kinds:
    """The messages of authentication in a DBC, and which of them belong to which role.

    Attributes
    ----------
    of : mapping of message identifier to "Seal", "Session" or "Challenge"
    messages : mapping of (role, kind) to Message
    asked : mapping of number in a challenge to role
    """

    def __init__(self, codec: Codec):
        self._codec = codec
        self.messages = {
            (m.sender, kind): m for m in codec.messages.values() for kind in _KINDS if m.name == m.sender + kind
        }
        self.of: Mapping[int, str] = {m.frame_id: kind for (_, kind), m in self.messages.items()}
        self._senders = {m.frame_id: m.sender for m in codec.messages.values()}
        roles = {role.lower(): role for role, _ in self.messages}
        challenge = next(m for (_, kind), m in self.messages.items() if kind == "Challenge")
        self.asked = {number: roles[name] for number, name in challenge.fields["asked"].names.items()}

    def node(self, frame_id: int) -> Node | None:
        """Who sends frames of this identifier; None where nobody of the DBC does."""
        role = self._senders.get(identifiers.message_id(frame_id))
        return None if role is None else Node(role, identifiers.actuator(frame_id))

    def seal(self, role: str) -> Message:
        """The message that seals what a role sends."""
        return self.messages[role, "Seal"]
