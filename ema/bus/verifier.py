"""The receiver's half of message authentication: lets through what a genuine seal names, asks whom it does not know."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from hmac import compare_digest
from typing import NamedTuple

import numpy as np

from ema.core import frames as fr

from . import identifiers, seals
from .codec import Codec
from .header import N_SEQUENCES, sequence
from .keys import MAC_BYTES, Key, Keyring
from .nodes import Kinds, Node
from .protection import Sender

PATIENCE_NS = 100_000_000  # a frame waits so long for its seal, by the time of the frames received
_MAX_WAITING = 4096  # frames
_ASK_NS = 1_000_000_000  # between two challenges to one node
_REFUSED = int(fr.FrameFlag.REFUSED)


class _Waiting(NamedTuple):
    """A frame that no seal has named yet."""

    row: bytes
    t_ns: int
    place: tuple[Node, int, int]  # node, Data ID, sequence number

    @property
    def payload(self) -> bytes:
        length = self.row[seals.DATA - 1]
        return self.row[seals.DATA : seals.DATA + length]


class _Layout:
    """Where a message of authentication has what, in a frame as bytes; the same for every role."""

    def __init__(self, codec: Codec, kind: str, mac: str):
        message = next(m for m in codec.messages.values() if m.name.endswith(kind))
        self.length = message.length
        self.covered = _moved(seals.covered(codec, kind, mac))
        self.mac = _moved(slice(message.fields[mac].byte, message.fields[mac].byte + MAC_BYTES))
        self.macs = seals.DATA + message.fields["mac"].byte
        self._parts = [
            (f.name, _moved(slice(f.byte, f.byte + f.dtype.itemsize)))
            for f in message.fields.values()
            if f.name not in ("mac", mac)
        ]

    def read(self, row: bytes) -> dict[str, int]:
        """What a frame says, its MACs left out."""
        return {name: int.from_bytes(row[part], "big") for name, part in self._parts}


def _moved(part: slice) -> slice:
    """A part of the payload as a part of the frame."""
    return slice(seals.DATA + part.start, seals.DATA + part.stop)


@dataclass(slots=True)
class _Known:
    """What is known of a node: nothing below it is accepted any more."""

    session: int = -1  # -1: unknown, and nothing is accepted
    counters: dict[int, int] = field(default_factory=dict)  # last one in that session, by Data ID
    nonce: bytes = b""  # of the challenge that waits for its answer
    asked_ns: int = -_ASK_NS
    wanted: bool = False  # is heard, but not known


class Verifier:
    """Lets frames through when their seal is there; what is not sealed in time, or wrongly, is marked as refused.

    A seal costs one MAC, each frame it names one more: a forged frame costs one at most. No frame waits for another
    one's seal, so that forged ones delay nothing. Time is that of the received frames: a reader that is late refuses
    no more than one that is not.

    Of a node whose session is not known nothing is accepted until it has answered a challenge.

    Parameters
    ----------
    codec : Codec
    keyring : Keyring
        May be replaced at any time.
    role : str
        As whom challenges are sent.

    Attributes
    ----------
    n_trials : int
        MACs that were computed.
    """

    def __init__(self, codec: Codec, keyring: Keyring, role: str = "Monitor"):
        self.keyring = keyring
        self.n_trials = 0
        self._codec, self._kinds, self._role = codec, Kinds(codec), role
        self._seal = _Layout(codec, "Seal", "seal_mac")
        self._session = _Layout(codec, "Session", "mac")
        self._numbers = {name: number for number, name in self._kinds.asked.items()}
        self._sender = Sender()
        self._n_arrived = 0
        self._waiting: dict[int, _Waiting] = {}  # by order of arrival
        self._by_place: dict[tuple[Node, int, int], list[int]] = {}  # of those, in their order
        self._known: dict[Node, _Known] = {}
        self._events: list[str] = []

    def feed(self, frames: np.ndarray, now_ns: int) -> np.ndarray:
        """Take received frames; those decided upon, in the order received, with FrameFlag.REFUSED where not genuine.

        Parameters
        ----------
        frames : array, shape (n,), FRAME_DTYPE
        now_ns : int
            Used while no frames come. [ns]

        Returns
        -------
        decided : array, shape (m,), FRAME_DTYPE
            Frames of no message that is sealed are among them; those of authentication itself are not.
        """
        decided: dict[int, tuple[bytes, bool]] = {}  # by order of arrival: frame, whether genuine
        columns = frames["id"].tolist(), sequence(frames).tolist(), frames["t_ns"].tolist()
        of_message = identifiers.message_id(frames["id"]).tolist()
        for row, message_id, frame_id, number, t_ns in zip(seals.rows(frames), of_message, *columns, strict=True):
            kind = self._kinds.of.get(message_id)
            node = self._kinds.node(frame_id)
            if node is None:
                self._n_arrived += 1
                decided[self._n_arrived] = row, True
            elif kind is None:
                self._n_arrived += 1
                waiting = _Waiting(row, t_ns, (node, identifiers.data_id(frame_id), number))
                self._waiting[self._n_arrived] = waiting
                self._by_place.setdefault(waiting.place, []).append(self._n_arrived)
            elif kind == "Seal":
                decided |= self._unseal(row, node)
            elif kind == "Session":
                self._settle(row, node)
        decided |= self._given_up(columns[2][-1] if frames.size else now_ns)
        return _told(decided)

    def ask(self, now_ns: int) -> np.ndarray:
        """Challenges to be sent now to nodes that are heard but not known.

        `now_ns` is of a clock that only goes on. [ns]
        """
        made = []
        for node, known in self._known.items():
            if known.wanted and now_ns - known.asked_ns >= _ASK_NS:
                known.nonce, known.asked_ns, known.wanted = os.urandom(8), now_ns, False
                values = {"nonce": np.uint64(int.from_bytes(known.nonce, "big")), "asked": self._numbers[node.role]}
                made.append(self._codec.encode(f"{self._role}Challenge", node.number, values))
        return self._sender.protect(fr.joined(made))

    def take_events(self) -> list[str]:
        """What happened to sessions since the last call, one line each."""
        events, self._events = self._events, []
        return events

    def _unseal(self, row: bytes, node: Node) -> dict[int, tuple[bytes, bool]]:
        """What a seal decides: each frame it names, once. A forged or old one decides nothing."""
        if row[seals.DATA - 1] != self._seal.length:
            return {}
        said, known = self._seal.read(row), self._known.setdefault(node, _Known())
        data_id, first = said["data_id"], said["first_counter"]
        freshness = said["session"], first
        known.wanted |= known.session < 0 or said["session"] < known.session  # to be asked where it cannot be fresh
        if known.session < 0 or freshness <= (known.session, known.counters.get(data_id, -1)):
            return {}
        key = self.keyring.keys(node).get(said["key"])
        if key is None or not self._fits(key, seals.of_seal(row[self._seal.covered]), row[self._seal.mac]):
            return {}
        if said["session"] > known.session:
            self._known[node] = known = _Known(said["session"], asked_ns=known.asked_ns)
        n_sealed = min(said["n_sealed"], seals.PER_SEAL)
        known.counters[data_id] = first + n_sealed - 1
        decided = {}
        for n in range(n_sealed):
            mac = row[self._seal.macs + n * MAC_BYTES :][:MAC_BYTES]
            for arrival in tuple(self._by_place.get((node, data_id, (first + n) % N_SEQUENCES), ())):
                content = seals.of_frame(data_id, said["session"], first + n, self._waiting[arrival].payload)
                decided[arrival] = self._taken(arrival), self._fits(key, content, mac)
        return decided

    def _settle(self, row: bytes, node: Node) -> None:
        """The answer to a challenge: the node's session is the one it names, from its beginning."""
        known = self._known.get(node)
        if known is None or not known.nonce or row[seals.DATA - 1] != self._session.length:
            return
        said = self._session.read(row)
        key = self.keyring.keys(node).get(said["key"])
        if said["nonce"] != int.from_bytes(known.nonce, "big") or key is None:
            return
        if not self._fits(key, seals.of_session(row[self._session.covered]), row[self._session.mac]):
            return
        if said["session"] > known.session:
            self._known[node] = _Known(said["session"], asked_ns=known.asked_ns)
            return
        known.nonce = b""
        self._events.append(
            f"{node} begins session {said['session']} after {known.session}: it has lost its session file, and is "
            f"refused until that holds a larger number"
        )

    def _fits(self, key: Key, content: bytes, mac: bytes) -> bool:
        self.n_trials += 1
        return compare_digest(key.mac(content), mac)

    def _given_up(self, now_ns: int) -> dict[int, tuple[bytes, bool]]:
        """What has waited too long."""
        late: list[int] = []
        for arrival, waiting in self._waiting.items():
            age = abs(now_ns - waiting.t_ns)  # either way: the clock may be set back
            if age <= PATIENCE_NS and len(self._waiting) - len(late) <= _MAX_WAITING:
                break
            late.append(arrival)
        return {arrival: (self._taken(arrival), False) for arrival in late}

    def _taken(self, arrival: int) -> bytes:
        """A frame that need not wait any more."""
        waiting = self._waiting.pop(arrival)
        same = self._by_place[waiting.place]
        same.remove(arrival)
        if not same:
            del self._by_place[waiting.place]
        return waiting.row


def _told(decided: dict[int, tuple[bytes, bool]]) -> np.ndarray:
    """Frames in the order of their arrival, those marked that are not genuine."""
    arrivals = sorted(decided)
    frames = np.frombuffer(bytearray(b"".join(decided[n][0] for n in arrivals)), fr.FRAME_DTYPE)
    genuine = np.array([decided[n][1] for n in arrivals], bool)
    frames["flags"][~genuine] |= _REFUSED
    return frames
