"""The sender's half of message authentication: seals what goes out, and begins a new session when asked to."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ema.core import frames as fr

from . import identifiers, seals
from .codec import Codec, Message
from .header import N_SEQUENCES, sequence
from .keys import Key, Keyring
from .nodes import Kinds, Node
from .protection import Sender
from .sessions import Sessions

_OFTEN = 0.02  # frames sent at least so often are sealed five at a time, every other one at once [s]
_PAUSE_NS = 1_000_000_000  # between two sessions of a node that challenges make it begin
_LARGEST = (1 << 32) - 1  # counter


@dataclass(slots=True)
class _Voice:
    """What is sent as one node in one session."""

    key: Key
    session: int
    begun_ns: int = -_PAUSE_NS  # when a challenge made it begin
    counters: dict[int, int] = field(default_factory=dict)  # last one by identifier
    pending: dict[int, list[bytes]] = field(default_factory=dict)  # payloads up to that counter, by identifier


def seal_period(message: Message) -> float:
    """Time between two seals of a periodic message's frames. [s]"""
    return message.period * (seals.PER_SEAL if message.period <= _OFTEN else 1)


class Sealer:
    """Makes the seals of outgoing frames.

    Parameters
    ----------
    codec : Codec
    keyring : Keyring
    sessions : Sessions

    Attributes
    ----------
    without_key : set of Node
        Who has sent something for which there is no key: it is not sealed, and will be refused.
    n_answers : int
        Challenges answered.
    """

    def __init__(self, codec: Codec, keyring: Keyring, sessions: Sessions):
        self.without_key: set[Node] = set()
        self.n_answers = 0
        self._codec, self._kinds = codec, Kinds(codec)
        self._keyring, self._sessions = keyring, sessions
        self._seal_part = seals.covered(codec, "Seal", "seal_mac")
        self._session_part = seals.covered(codec, "Session", "mac")
        self._sender = Sender()
        self._voices: dict[Node, _Voice] = {}

    def add(self, frames: np.ndarray) -> np.ndarray:
        """Take protected frames that are sent now; the seals to be sent right after them."""
        made: list[np.ndarray] = []
        columns = frames["id"].tolist(), sequence(frames).tolist(), frames["length"].tolist()
        for row, frame_id, number, length in zip(seals.rows(frames), *columns, strict=True):
            node = self._kinds.node(frame_id)
            if node is None:
                continue
            key = self._keyring.sealing(node)
            if key is None:
                self.without_key.add(node)
                continue
            voice = self._voices.get(node) or self._begin(node, key)
            last = voice.counters.get(frame_id, -1)
            counter = last + 1 + (number - last - 1) % N_SEQUENCES  # its sequence number, counted on beyond 16 bits
            if voice.pending.get(frame_id) and counter != last + 1:
                made.append(self._close(node, voice, frame_id))
            if counter > _LARGEST:
                made += self._close_all(node, voice)
                voice, counter = self._begin(node, key), number
            voice.counters[frame_id] = counter
            voice.pending.setdefault(frame_id, []).append(row[seals.DATA : seals.DATA + length])
            period = self._codec.find(frame_id).period  # type: ignore[union-attr]
            if not period:
                made += self._close_all(node, voice)
            elif period > _OFTEN or len(voice.pending[frame_id]) == seals.PER_SEAL:
                made.append(self._close(node, voice, frame_id))
        return self._sender.protect(fr.joined(made))

    def rekey(self, keyring: Keyring) -> np.ndarray:
        """Seal with other keys from now on; the seals, with those of before, of what waits for one."""
        made = [seal for node, voice in self._voices.items() for seal in self._close_all(node, voice)]
        self._keyring = keyring
        for node, voice in self._voices.items():
            voice.key = keyring.sealing(node) or voice.key
        return self._sender.protect(fr.joined(made))

    def hear(self, frames: np.ndarray, now_ns: int) -> np.ndarray:
        """The answers to the challenges among received frames; `now_ns` is of a clock that only goes on. [ns]"""
        answers: list[np.ndarray] = []
        for message, part in self._codec.split(frames):
            if self._kinds.of.get(message.frame_id) != "Challenge":
                continue
            part = part[part["length"] == message.length]
            asked = message.decode(part)
            for frame_id, nonce, role in zip(part["id"].tolist(), asked["nonce"], asked["asked"].tolist(), strict=True):
                node = Node(self._kinds.asked.get(role, ""), identifiers.actuator(frame_id))
                if node in self._voices:
                    answers += self._answer(node, nonce, now_ns)
        return self._sender.protect(fr.joined(answers))

    def _begin(self, node: Node, key: Key) -> _Voice:
        voice = self._voices[node] = _Voice(key, self._sessions.take())
        return voice

    def _answer(self, node: Node, nonce: np.uint64, now_ns: int) -> list[np.ndarray]:
        """A session begun after the challenge had come, so that nothing recorded before is of it."""
        voice = self._voices[node]
        if now_ns - voice.begun_ns < _PAUSE_NS:
            return []
        last = self._close_all(node, voice)
        voice = self._begin(node, voice.key)
        voice.begun_ns = now_ns
        self.n_answers += 1
        message = self._kinds.messages[node.role, "Session"]
        values = {"nonce": nonce, "session": voice.session, "key": voice.key.number, "mac": np.uint64(0)}
        frame = self._codec.encode(message.name, node.number, values)
        mac = voice.key.mac(seals.of_session(frame["data"][0, self._session_part].tobytes()))
        message.fields["mac"].view(frame)[0] = int.from_bytes(mac, "big")
        return [*last, frame]

    def _close_all(self, node: Node, voice: _Voice) -> list[np.ndarray]:
        return [self._close(node, voice, frame_id) for frame_id in list(voice.pending)]

    def _close(self, node: Node, voice: _Voice, frame_id: int) -> np.ndarray:
        """The seal of what is pending of one identifier."""
        payloads = voice.pending.pop(frame_id)
        first = voice.counters[frame_id] + 1 - len(payloads)
        data_id = identifiers.data_id(frame_id)
        macs = [
            int.from_bytes(voice.key.mac(seals.of_frame(data_id, voice.session, first + n, payload)), "big")
            for n, payload in enumerate(payloads)
        ]
        message = self._kinds.seal(node.role)
        values = {
            "data_id": data_id,
            "n_sealed": len(macs),
            "key": voice.key.number,
            "session": voice.session,
            "first_counter": first,
            "mac": np.array(macs + [0] * (seals.PER_SEAL - len(macs)), np.uint64),
            "seal_mac": np.uint64(0),
        }
        frame = self._codec.encode(message.name, node.number, values)
        mac = voice.key.mac(seals.of_seal(frame["data"][0, self._seal_part].tobytes()))
        message.fields["seal_mac"].view(frame)[0] = int.from_bytes(mac, "big")
        return frame
