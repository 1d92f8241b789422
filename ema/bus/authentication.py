"""Message authentication of frames: AES-CMAC, truncated, with a freshness counter (RFC 4493; after AUTOSAR SecOC).

Frames of 64 bytes have no room for a MAC, so it travels in frames of its own (`ActuatorSeal`, `MonitorSeal`), each
sealing up to ten frames with consecutive numbers of one identifier, a MAC of 32 bits for each: one lost frame costs no
other. Freshness is the sender's clock, strictly increasing, and has to agree with the receiver's: what was recorded
earlier is refused, also after either side was restarted.
"""

from __future__ import annotations

import os
import string
from pathlib import Path

import numpy as np
from cryptography.hazmat.primitives.ciphers.algorithms import AES
from cryptography.hazmat.primitives.cmac import CMAC

from ema.core import frames as fr
from ema.core.errors import BusError

from . import identifiers
from .codec import Codec, Message
from .header import N_SEQUENCES, sequence
from .protection import Sender

PER_SEAL = 10
_MAC_BYTES = 4
_IN_TENS = "PhaseCurrents"  # sealed ten at a time; every other message at once
_WINDOW_NS = 2_000_000_000  # clocks of sender and receiver may differ by so much
_PATIENCE_NS = 50_000_000  # a frame waits so long for its seal
_MAX_WAITING = 4096  # frames


def load_key(path: Path) -> bytes:
    """Key from a file of 32, 48 or 64 hexadecimal digits that nobody but its owner can read; BusError otherwise.

    What systemd hands to a service (LoadCredential=) only that can read, though its mode may look otherwise.
    """
    try:
        mode, text = path.stat().st_mode, path.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "not hexadecimal digits"
        raise BusError(f"key file {path}: cannot be read ({why})") from error
    if mode & 0o077 and Path(os.environ.get("CREDENTIALS_DIRECTORY", os.devnull)) not in path.parents:
        raise BusError(f"key file {path}: others can read it: chmod 600 {path}")
    if len(text) not in (32, 48, 64) or not set(text) <= set(string.hexdigits):
        raise BusError(f"key file {path}: must hold 32, 48 or 64 hexadecimal digits (AES-128, 192 or 256)")
    return bytes.fromhex(text)


class _Authenticator:
    """What sender and receiver share: the key, and which frames are sealed by which message."""

    def __init__(self, codec: Codec, key: bytes):
        self._codec = codec
        self._cmac = CMAC(AES(key))
        self._seals = {m.sender: m for m in codec.messages.values() if m.name.endswith("Seal")}

    def seal_of(self, frame_id: int) -> Message | None:
        """The message that seals frames of this identifier; None where they are not sealed, as a seal itself."""
        message = self._codec.find(frame_id)
        if message is None or message.name.endswith("Seal"):
            return None
        return self._seals.get(message.sender)

    def mac(self, data_id: int, freshness: int, payload: bytes) -> int:
        """MAC of one frame."""
        cmac = self._cmac.copy()
        cmac.update(data_id.to_bytes(2, "big") + freshness.to_bytes(8, "big") + payload)
        return int.from_bytes(cmac.finalize()[:_MAC_BYTES], "big")


class Sealer(_Authenticator):
    """Makes the seals of outgoing frames."""

    def __init__(self, codec: Codec, key: bytes):
        super().__init__(codec, key)
        self._sender = Sender()
        self._freshness = 0
        self._pending: dict[int, list[np.ndarray]] = {}  # frames by identifier

    def add(self, frames: np.ndarray, now_ns: int) -> np.ndarray:
        """Take protected frames that are sent now; the seals to be sent right after them."""
        seals = []
        for n, frame_id in enumerate(frames["id"].tolist()):
            seal = self.seal_of(frame_id)
            if seal is None:
                continue
            pending = self._pending.setdefault(frame_id, [])
            if pending and int(sequence(frames[n])) != (int(sequence(pending[-1])) + 1) % N_SEQUENCES:
                seals.append(self._close(frame_id, seal, now_ns))
                pending = self._pending.setdefault(frame_id, [])
            pending.append(frames[n])
            if self._codec.find(frame_id).name != _IN_TENS:  # type: ignore[union-attr]
                seals += self._close_all(identifiers.actuator(frame_id), now_ns)
            elif len(pending) == PER_SEAL:
                seals.append(self._close(frame_id, seal, now_ns))
        return self._sender.protect(fr.joined(seals))

    def _close_all(self, actuator: int, now_ns: int) -> list[np.ndarray]:
        ids = [i for i in self._pending if identifiers.actuator(i) == actuator]
        return [self._close(i, self.seal_of(i), now_ns) for i in ids]

    def _close(self, frame_id: int, seal: Message | None, now_ns: int) -> np.ndarray:
        assert seal is not None
        frames = self._pending.pop(frame_id)
        self._freshness = max(self._freshness + 1, now_ns // 1000)
        data_id = identifiers.data_id(frame_id)
        macs = [self.mac(data_id, self._freshness, _payload(frame)) for frame in frames]
        values = {
            "data_id": data_id,
            "first_sequence": int(sequence(frames[0])),
            "n_sealed": len(frames),
            "freshness": np.uint64(self._freshness),
            "mac": np.array(macs + [0] * (PER_SEAL - len(macs)), np.uint32),
        }
        return self._codec.encode(seal.name, identifiers.actuator(frame_id), values)


class Verifier(_Authenticator):
    """Lets frames through when their seal is there; what is not sealed in time, or wrongly, is marked as refused.

    No frame waits for another one's seal, so that forged ones delay nothing. Time is that of the received frames: a
    reader that is late refuses no more than one that is not.
    """

    def __init__(self, codec: Codec, key: bytes):
        super().__init__(codec, key)
        self._n_arrived = 0
        self._waiting: dict[int, np.ndarray] = {}  # frames, shape (1,), by order of arrival
        self._by_number: dict[tuple[int, int], list[int]] = {}  # of those, by Data ID and sequence number
        self._freshness: dict[int, int] = {}  # last one by Data ID

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
            Frames of no message that is sealed are among them; seals are not.
        """
        decided: dict[int, np.ndarray] = {}
        for n, (frame_id, number) in enumerate(zip(frames["id"].tolist(), sequence(frames).tolist(), strict=True)):
            frame = frames[n : n + 1]
            message = self._codec.find(frame_id)
            if message is not None and message.name.endswith("Seal"):
                decided |= self._unseal(message, frame)
                continue
            self._n_arrived += 1
            if self.seal_of(frame_id) is None:
                decided[self._n_arrived] = frame
            else:
                self._waiting[self._n_arrived] = frame.copy()
                self._by_number.setdefault((identifiers.data_id(frame_id), number), []).append(self._n_arrived)
        decided |= self._given_up(int(frames["t_ns"][-1]) if frames.size else now_ns)
        return fr.joined([decided[n] for n in sorted(decided)])

    def _unseal(self, message: Message, frame: np.ndarray) -> dict[int, np.ndarray]:
        """What a seal decides: once one frame shows that it is genuine, all the others with its numbers as well."""
        if frame["length"][0] != message.length:
            return {}
        said = {name: value[0] for name, value in message.decode(frame).items()}
        data_id, freshness = int(said["data_id"]), int(said["freshness"])
        is_late = freshness <= self._freshness.get(data_id, 0)
        if is_late or abs(freshness * 1000 - int(frame["t_ns"][0])) > _WINDOW_NS:
            return {}
        genuine: dict[int, bool] = {}
        for n in range(min(int(said["n_sealed"]), PER_SEAL)):
            for arrival in self._by_number.get((data_id, (int(said["first_sequence"]) + n) % N_SEQUENCES), ()):
                mac = self.mac(data_id, freshness, _payload(self._waiting[arrival][0]))
                genuine[arrival] = mac == int(said["mac"][n])
        if not any(genuine.values()):
            return {}
        self._freshness[data_id] = freshness  # a forged seal cannot advance it
        return {arrival: self._taken(arrival, fits) for arrival, fits in genuine.items()}

    def _given_up(self, now_ns: int) -> dict[int, np.ndarray]:
        """What has waited too long."""
        late: list[int] = []
        for arrival, frame in self._waiting.items():
            age = abs(now_ns - int(frame["t_ns"][0]))  # either way: the clock may be set back
            if age <= _PATIENCE_NS and len(self._waiting) - len(late) <= _MAX_WAITING:
                break
            late.append(arrival)
        return {arrival: self._taken(arrival, False) for arrival in late}

    def _taken(self, arrival: int, genuine: bool) -> np.ndarray:
        """A frame that need not wait any more."""
        frame = self._waiting.pop(arrival)
        key = identifiers.data_id(int(frame["id"][0])), int(sequence(frame)[0])
        same = self._by_number[key]
        same.remove(arrival)
        if not same:
            del self._by_number[key]
        if not genuine:
            frame["flags"] |= int(fr.FrameFlag.REFUSED)
        return frame


def _payload(frame: np.ndarray) -> bytes:
    data: bytes = frame["data"][: int(frame["length"])].tobytes()
    return data
